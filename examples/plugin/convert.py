#!/usr/bin/env python3
"""libsmoothpost from Python, with nothing but ctypes.

  convert.py --library libsmoothpost.so --header smoothpost.h INPUT OPTION=VALUE...

OPTION is a member of smoothpost_options: machine=table_table_bc tool=1=60 output=out.ngc. The options' names, order and
types are read from the header, so that this file need not change with them.
"""

import argparse
import ctypes
import re
import sys
from pathlib import Path

Progress = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_char_p, ctypes.c_double)
TYPES = {"size_t": ctypes.c_size_t, "int": ctypes.c_int, "const char*": ctypes.c_char_p,
         "const void*": ctypes.c_void_p, "void*": ctypes.c_void_p, "smoothpost_progress": Progress,
         "const char* const*": ctypes.POINTER(ctypes.c_char_p)}


def structure_of(header, name):
    """The ctypes structure that the C header declares under that name."""
    text = re.sub(r"/\*.*?\*/", " ", header, flags=re.DOTALL)
    body = re.search(r"typedef struct %s \{(.*?)\} %s;" % (name, name), text, re.DOTALL).group(1)
    fields = []
    for member in filter(None, (" ".join(part.split()) for part in body.split(";"))):
        kind, field = re.fullmatch(r"(.*?)\s*(\w+)", member).groups()
        fields.append((field, TYPES[kind] if kind in TYPES else ctypes.c_int))  # an enum is an int
    return type(name, (ctypes.Structure,), {"_fields_": fields})


class Smoothpost:
    def __init__(self, library, header):
        text = Path(header).read_text(encoding="utf-8")
        self.Options = structure_of(text, "smoothpost_options")
        self.Diagnostic = structure_of(text, "smoothpost_diagnostic")
        self.c = ctypes.CDLL(str(library))
        for name in re.findall(r"SMOOTHPOST_API const char\*\s+(\w+)", text):
            getattr(self.c, name).restype = ctypes.c_void_p  # bytes with a size, maybe with zeros in them
        self.c.smoothpost_result_diagnostic_count.restype = ctypes.c_size_t
        wanted = int(re.search(r"#define SMOOTHPOST_ABI_VERSION (\d+)", text).group(1))
        if self.c.smoothpost_abi_version() != wanted:
            raise RuntimeError("the library has another ABI than the header")

    def run(self, progress=None, **given):
        """Runs a command: the options by name, lists as lists. Returns a Result."""
        options = self.Options()
        self.c.smoothpost_options_init(ctypes.byref(options), ctypes.c_size_t(ctypes.sizeof(options)))
        kinds = dict(self.Options._fields_)
        alive = []  # what the structure points to has to live until the call is over
        for name, value in given.items():
            if kinds[name] == TYPES["const char* const*"]:
                words = [value] if isinstance(value, str) else value
                array = (ctypes.c_char_p * len(words))(*[word.encode() for word in words])
                alive.append(array)
                setattr(options, name, ctypes.cast(array, kinds[name]))
                setattr(options, "argument_count" if name == "arguments" else name + "_count", len(words))
            else:
                setattr(options, name, value.encode() if isinstance(value, str) else value)
        if progress:
            callback = Progress(lambda _, stage, share: 0 if progress(stage.decode(), share) else 1)
            alive.append(callback)
            options.progress = callback
        handle = ctypes.c_void_p()
        status = self.c.smoothpost_run(ctypes.byref(options), ctypes.byref(handle))
        if not handle:
            raise MemoryError(f"smoothpost ended with status {status}")
        return Result(self, status, handle)


class Result:
    """What a run made; everything is copied out, so that it may outlive the library's result."""

    def __init__(self, library, status, handle):
        c = library.c
        self.status = status

        def copied(name, *index):
            size = ctypes.c_size_t()
            start = getattr(c, "smoothpost_result_" + name)(handle, *index, ctypes.byref(size))
            return ctypes.string_at(start, size.value)

        def text(name, *index):
            return ctypes.string_at(getattr(c, "smoothpost_result_" + name)(handle, *index)).decode()

        self.program, self.report, self.page = copied("program"), copied("report"), copied("page")
        self.text = copied("text").decode()
        self.summary, self.verdict = text("summary"), text("verdict")
        count = c.smoothpost_result_plot_count(handle)
        self.plots = {text("plot_name", i): copied("plot", i) for i in map(ctypes.c_size_t, range(count))}
        self.diagnostics = []
        for i in range(c.smoothpost_result_diagnostic_count(handle)):
            d = library.Diagnostic()
            d.size = ctypes.sizeof(d)
            c.smoothpost_result_diagnostic(handle, ctypes.c_size_t(i), ctypes.byref(d))
            self.diagnostics.append({"code": d.code.decode(), "text": d.text.decode(), "file": d.file.decode(),
                                     "line": d.line, "formatted": d.formatted.decode()})
        c.smoothpost_result_destroy(handle)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--library", dest="shared_object", required=True)
    parser.add_argument("--header", required=True)
    parser.add_argument("input")
    parser.add_argument("option", nargs="*")
    given = parser.parse_args()
    smoothpost = Smoothpost(given.shared_object, given.header)
    options = {"command": "convert", "input": given.input}
    kinds = dict(smoothpost.Options._fields_)
    for word in given.option:
        name, _, value = word.partition("=")
        if name not in kinds:
            sys.exit(f"smoothpost_options has no member {name}")
        options[name] = int(value) if kinds[name] is ctypes.c_int else value

    def show(stage, share):
        print(f"\r{100 * share:3.0f} % {stage:20}", end="", file=sys.stderr)
        return True  # False cancels

    result = smoothpost.run(progress=show, **options)
    print("\r" + 30 * " " + "\r", end="", file=sys.stderr)
    for diagnostic in result.diagnostics:
        print(diagnostic["formatted"], file=sys.stderr)
    print(result.summary)
    return result.status


if __name__ == "__main__":
    sys.exit(main())
