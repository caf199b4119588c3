#!/usr/bin/env python3
"""Checks the layers of the house: who may include what, and what may stand in a component at all.

  layers_test.py [ROOT]       checks the tree at ROOT against ROOT/tests/tools/layers.txt
  layers_test.py --self-test  builds small trees with one violation each and sees each one reported
"""

import re
import sys
import tempfile
from pathlib import Path

FLOORS = ["kernels", "formats", "machines", "postproc"]
SOURCE_SUFFIXES = {".h", ".hpp", ".hh", ".cpp", ".cc", ".cxx", ".c"}
HEADER_SUFFIXES = {".h", ".hpp", ".hh"}
# A header outside the floors' two levels: the C interface that a stranger's compiler sees.
PUBLIC_INCLUDE = "postproc/capi/include"
MAX_CGAL_UNITS = 6

STANDARD_HEADERS = set("""
algorithm any array atomic barrier bit bitset charconv chrono codecvt compare complex concepts
condition_variable coroutine deque exception execution expected filesystem format forward_list fstream
functional future initializer_list iomanip ios iosfwd iostream istream iterator latch limits list locale
map memory memory_resource mutex new numbers numeric optional ostream queue random ranges ratio regex
scoped_allocator semaphore set shared_mutex source_location span sstream stack stdexcept stop_token
streambuf string string_view syncstream system_error thread tuple type_traits typeindex typeinfo
unordered_map unordered_set utility valarray variant vector version
cassert cctype cerrno cfenv cfloat cinttypes climits clocale cmath csetjmp csignal cstdarg cstddef
cstdint cstdio cstdlib cstring ctime cuchar cwchar cwctype
""".split())
# The public header is C: it may use C's own headers.
C_HEADERS = {"stddef.h", "stdint.h", "stdbool.h"}

# Units that have no place in the names of kernels/: a bare name is in mm, rad, s. (A spline has a
# degree: that word is not one of them.)
UNIT_SUFFIXES = """
deg degrees inch inches foot feet min_per per_min per_minute rpm ms us millis milliseconds
minute minutes metre metres meter meters m_per_s m_per_s2 m_per_s3 percent
""".split()
UNIT_NAME = re.compile(
    r"(?:^|_)(?:%s)(?:_per_(?:s|s2|s3|min|minute))?_?$" % "|".join(UNIT_SUFFIXES), re.IGNORECASE)
UNIT_EXEMPT_FILES = {"kernels/core/units.h"}
UNIT_EXEMPT_NAMES = {"kernels/core/check.h": {"time_s"}}

# A namespace that opens, its end, or a type that is defined, each at the start of a line.
TYPE_OR_SPACE = re.compile(
    r"^(?:namespace (?P<space>[\w:]+) \{|(?:struct|class|enum class|enum) (?P<type>\w+)[^;{]*\{|\}  // namespace)",
    re.MULTILINE)

# Below postproc/cli nothing prints, ends the process, asks the locale or reads a clock of the day.
FORBIDDEN_HEADERS = {
    "iostream": "prints", "cassert": "aborts (use require())", "clocale": "is global state",
    "locale": "is global state", "csignal": "is global state", "csetjmp": "is global state",
}
FORBIDDEN_CALLS = [
    (re.compile(r"(?<![\w.>])(?:std::)?(printf|fprintf|vprintf|vfprintf|puts|fputs|putchar|perror)\s*\("),
     "prints"),
    (re.compile(r"\bstd::(cout|cerr|clog)\b"), "prints"),
    (re.compile(r"(?<![\w.>:])(?:std::|::)?(exit|_exit|_Exit|quick_exit|abort|terminate)\s*\("),
     "ends the process"),
    (re.compile(r"(?<![\w.>])(assert)\s*\("), "aborts (use require())"),
    (re.compile(r"(?<![\w.>])(?:std::)?(setlocale|localeconv)\s*\("), "is global state"),
    (re.compile(r"(?<![\w.>])(?:std::)?(strtod|strtof|atof|stod|stof|sscanf|sprintf|snprintf)\s*\("),
     "depends on the locale (use from_chars and to_chars)"),
    (re.compile(r"\b(system_clock)\b"), "makes the output depend on the day"),
    (re.compile(r"(?<![\w.>])(?:std::)?(rand|srand)\s*\("), "is global state"),
]
PRINTING_COMPONENTS = {"postproc/cli"}

INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]*(?:<([^>\n]+)>|"([^"\n]+)")', re.MULTILINE)


class Row:
    def __init__(self, components, anywhere, cpp_only):
        self.components = components
        self.anywhere = anywhere
        self.cpp_only = cpp_only


def read_table(path):
    """The rows of layers.txt by component, and what is wrong with the table itself."""
    rows, problems = {}, []
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        line = line.strip()
        if not line or line.startswith("#"):
            continue
        cells = [cell.strip() for cell in line.split("|")]
        if len(cells) != 4:
            problems.append(f"{path.name}:{number}: a row has four columns, this one {len(cells)}")
            continue
        lists = [[] if cell == "-" else cell.split() for cell in cells[1:]]
        if cells[0] in rows:
            problems.append(f"{path.name}:{number}: second row for {cells[0]}")
        rows[cells[0]] = Row(*lists)
    for name, row in rows.items():
        floor = name.split("/")[0]
        if floor not in FLOORS:
            problems.append(f"{path.name}: {name} is on no floor")
            continue
        for other in row.components:
            if other not in rows:
                problems.append(f"{path.name}: {name} may include {other}, which has no row")
            elif FLOORS.index(other.split("/")[0]) > FLOORS.index(floor):
                problems.append(f"{path.name}: {name} may include {other}, which is a floor above it")
    problems += [f"{path.name}: {name} may include itself through others" for name in in_a_circle(rows)]
    return rows, problems


def in_a_circle(rows):
    """Components that reach themselves through the table."""
    for start in rows:
        seen, waiting = set(), list(rows[start].components)
        while waiting:
            name = waiting.pop()
            if name == start:
                yield start
                break
            if name not in seen and name in rows:
                seen.add(name)
                waiting += rows[name].components


def blank(text):
    """The text with comments and the insides of string and character literals replaced by blanks."""
    def blanks(match):
        found = match.group(0)
        if found[0] in "\"'":
            return found[0] + re.sub(r"[^\n]", " ", found[1:-1]) + found[-1]
        return re.sub(r"[^\n]", " ", found)
    token = re.compile(
        r'//[^\n]*|/\*.*?\*/|R"([^(\s]*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|(?<![0-9a-fA-F])\'(?:\\.|[^\'\\\n])+\'',
        re.DOTALL)
    return token.sub(blanks, text)


def component_of(path, rows):
    """The row that the file belongs to: its folder, two levels deep, or the public include folder."""
    folder = path.rsplit("/", 1)[0] if "/" in path else ""
    if folder.startswith(PUBLIC_INCLUDE + "/"):
        return PUBLIC_INCLUDE
    return folder if folder in rows else None


def allowed(header, patterns):
    return any(header.startswith(p) if p.endswith("/") else header == p for p in patterns)


class Tree:
    def __init__(self, root):
        self.root = Path(root)
        self.rows, self.problems = read_table(self.root / "tests/tools/layers.txt")
        self.cgal_units = []
        self.used = set()
        self.types = {}  # with its namespace: the header that defines it

    def say(self, path, text, position, message):
        line = text.count("\n", 0, position) + 1
        self.problems.append(f"{path}:{line}: {message}")

    def check(self):
        for floor in FLOORS:
            for file in sorted((self.root / floor).rglob("*")):
                if file.is_file() and file.suffix in SOURCE_SUFFIXES:
                    self.check_file(file)
        for name in self.rows:
            if name not in self.used:
                self.problems.append(f"layers.txt: {name} has a row but no source")
        if len(self.cgal_units) > MAX_CGAL_UNITS:
            self.problems.append(f"{len(self.cgal_units)} translation units include CGAL, at most "
                                 f"{MAX_CGAL_UNITS} may: {' '.join(self.cgal_units)}")
        return self.problems

    def check_file(self, file):
        path = file.relative_to(self.root).as_posix()
        component = component_of(path, self.rows)
        if component is None:
            self.problems.append(f"{path}:1: its folder has no row in layers.txt")
            return
        self.used.add(component)
        text = file.read_text(encoding="utf-8")
        code = blank(text)
        if file.suffix in HEADER_SUFFIXES and component != PUBLIC_INCLUDE:
            if not re.search(r"^#pragma once$", text, re.MULTILINE):
                self.problems.append(f"{path}:1: a header without #pragma once")
            self.check_types(path, text)
        self.check_includes(path, component, text, code)
        if component not in PRINTING_COMPONENTS:
            self.check_calls(path, code)
        if path.startswith("kernels/"):
            self.check_names(path, code)

    def check_types(self, path, text):
        """Two types of one name in one namespace: the linker takes either for both, without a word."""
        spaces = []
        for match in TYPE_OR_SPACE.finditer(text):
            if match.group("space") is not None:
                spaces.append(match.group("space"))
            elif match.group("type") is None:
                if spaces:
                    spaces.pop()
            else:
                name = "::".join(spaces + [match.group("type")])
                other = self.types.setdefault(name, path)
                if other != path:
                    self.say(path, text, match.start(), f"{name} is defined in {other}, too")

    def check_includes(self, path, component, text, code):
        includes_cgal = False
        for match in INCLUDE.finditer(text):
            if not code[match.start():match.end()].strip():
                continue  # inside a comment
            header = match.group(1) or match.group(2)
            includes_cgal |= header.startswith("CGAL/")
            message = self.refuse_include(path, component, header, quoted=match.group(2) is not None)
            if message:
                self.say(path, text, match.start(), message)
        if includes_cgal:
            self.cgal_units.append(path)

    def refuse_include(self, path, component, header, quoted):
        row = self.rows[component]
        target = self.own_component(header)
        if target:
            if target == component or target in row.components:
                return None
            return f"{component} may not include {header} (layers.txt)"
        if quoted:
            return f'"{header}" is no header of a component (include from the root)'
        if header in STANDARD_HEADERS:
            if header in FORBIDDEN_HEADERS and component not in PRINTING_COMPONENTS:
                return f"<{header}> {FORBIDDEN_HEADERS[header]}: only postproc/cli may include it"
            return None
        if component == PUBLIC_INCLUDE and header in C_HEADERS:
            return None
        if allowed(header, row.anywhere):
            return None
        if allowed(header, row.cpp_only):
            if Path(path).suffix in HEADER_SUFFIXES:
                return f"<{header}> may not appear in a header of ours"
            return None
        return f"{component} may not include <{header}> (layers.txt)"

    def own_component(self, header):
        if header.startswith("smoothpost/"):
            return PUBLIC_INCLUDE
        if header.split("/")[0] not in FLOORS:
            return None
        return component_of(header, self.rows) or header.rsplit("/", 1)[0]

    def check_calls(self, path, code):
        for pattern, why in FORBIDDEN_CALLS:
            for match in pattern.finditer(code):
                self.say(path, code, match.start(), f"{match.group(1)} {why}: only postproc/cli may")

    def check_names(self, path, code):
        if path in UNIT_EXEMPT_FILES:
            return
        exempt = UNIT_EXEMPT_NAMES.get(path, set())
        for match in re.finditer(r"\b[A-Za-z_]\w*\b", code):
            name = match.group(0)
            if UNIT_NAME.search(name) and name not in exempt:
                self.say(path, code, match.start(),
                         f"{name}: kernels/ knows mm, rad and s only, and says so by bare names")


# --- self-test ---------------------------------------------------------------------------------------

GOOD_TREE = {
    "tests/tools/layers.txt": """
# a small house
kernels/core     | -                          | Eigen/ | -
kernels/geometry | kernels/core               | Eigen/ | CGAL/
formats/nc       | kernels/core               | -      | -
machines/dialects | kernels/core formats/nc   | -      | -
postproc/capi    | kernels/core postproc/capi/include | - | -
postproc/capi/include | -                     | -      | -
postproc/cli     | postproc/capi/include      | -      | CLI/
""",
    "kernels/core/pose.h": "#pragma once\n#include <Eigen/Core>\n// 90 deg, or printf(\"x\")\n"
                           "double turn_min(double angle_s);\n",
    "kernels/core/units.h": "#pragma once\nconstexpr double kA = 1; double radians(double degrees);\n",
    "kernels/core/check.h": "#pragma once\nstruct Check { double time_s = 0.0; };\n",
    "kernels/core/box.h": "#pragma once\nnamespace smoothpost {\nclass Tree;\ndouble f() {\n  return 1.0;\n}\nstruct Tree {\n"
                          "  struct Node {};\n};\nnamespace other {\nstruct Tree {};\n}  // namespace\n}  // namespace\n",
    "kernels/geometry/tree.h": "#pragma once\n#include \"kernels/core/pose.h\"\n",
    "kernels/geometry/tree.cpp": "#include \"kernels/geometry/tree.h\"\n#include <CGAL/AABB_tree.h>\n"
                                 "const char* a = \"feed_deg\"; // abort(\n",
    "formats/nc/parser.h": "#pragma once\n#include \"kernels/core/pose.h\"\ndouble feed_mm_per_min;\n",
    "machines/dialects/linuxcnc.cpp": "#include <string>\n#include \"formats/nc/parser.h\"\n",
    "postproc/capi/include/smoothpost/smoothpost.h": "#ifndef A\n#define A\n#include <stdint.h>\n#endif\n",
    "postproc/capi/capi.cpp": "#include \"smoothpost/smoothpost.h\"\n",
    "postproc/cli/main.cpp": "#include <iostream>\n#include <CLI/CLI.hpp>\n"
                             "#include \"smoothpost/smoothpost.h\"\nint main() { std::cout << 1; }\n",
    "tests/kernels/core/pose_test.cpp": "#include <iostream>\n#include <catch2/catch.hpp>\n",
    "examples/maker.cpp": "#include <iostream>\n",
}

# (what is tried, file, its content, what the report must say)
VIOLATIONS = [
    ("include of a floor above", "kernels/core/a.cpp", '#include "formats/nc/parser.h"\n',
     "kernels/core may not include formats/nc/parser.h"),
    ("sideways include that is not listed", "kernels/core/a.cpp", '#include "kernels/geometry/tree.h"\n',
     "kernels/core may not include kernels/geometry/tree.h"),
    ("include that is not from the root", "kernels/core/a.cpp", '#include "pose.h"\n',
     "include from the root"),
    ("include of a test", "kernels/core/a.cpp", '#include "tests/support/support.h"\n',
     "is no header of a component"),
    ("the tool reaches past the C interface", "postproc/cli/a.cpp", '#include "kernels/core/pose.h"\n',
     "postproc/cli may not include kernels/core/pose.h"),
    ("third-party header in the wrong component", "formats/nc/a.cpp", "#include <CGAL/AABB_tree.h>\n",
     "formats/nc may not include <CGAL/AABB_tree.h>"),
    ("Ipopt anywhere yet", "kernels/geometry/a.cpp", "#include <IpIpoptApplication.hpp>\n",
     "kernels/geometry may not include <IpIpoptApplication.hpp>"),
    ("NLopt anywhere yet", "kernels/core/a.cpp", "#include <nlopt.hpp>\n",
     "kernels/core may not include <nlopt.hpp>"),
    ("FCL anywhere yet", "kernels/geometry/a.cpp", "#include <fcl/fcl.h>\n", "may not include <fcl/fcl.h>"),
    ("third-party header in a header", "kernels/geometry/a.h", "#pragma once\n#include <CGAL/AABB_tree.h>\n",
     "may not appear in a header of ours"),
    ("CLI11 below the command line", "postproc/capi/a.cpp", "#include <CLI/CLI.hpp>\n",
     "postproc/capi may not include <CLI/CLI.hpp>"),
    ("header without a guard", "kernels/core/a.h", "int a();\n", "a header without #pragma once"),
    ("degrees in a kernel", "kernels/core/a.h", "#pragma once\ndouble tilt_deg;\n", "tilt_deg: kernels/"),
    ("degrees in a kernel's member", "kernels/core/a.h", "#pragma once\ndouble tilt_degrees_;\n",
     "tilt_degrees_: kernels/"),
    ("a rate in degrees", "kernels/core/a.h", "#pragma once\ndouble w_deg_per_s2;\n", "w_deg_per_s2: kernels/"),
    ("inches in a kernel", "kernels/core/a.h", "#pragma once\ndouble width_inch;\n", "width_inch: kernels/"),
    ("minutes in a kernel", "kernels/core/a.cpp", "double feed_mm_per_min = 0;\n", "feed_mm_per_min: kernels/"),
    ("metres in a kernel", "kernels/core/a.cpp", "double speed_m_per_s = 0;\n", "speed_m_per_s: kernels/"),
    ("iostream below the command line", "kernels/core/a.cpp", "#include <iostream>\n", "<iostream> prints"),
    ("printf", "kernels/core/a.cpp", 'void f() { std::printf("x"); }\n', "a.cpp:1: printf prints"),
    ("exit", "formats/nc/a.cpp", "void f() { std::exit(1); }\n", "exit ends the process"),
    ("abort", "formats/nc/a.cpp", "void f() {\n  abort();\n}\n", "a.cpp:2: abort ends the process"),
    ("assert", "formats/nc/a.cpp", "void f(int a) { assert(a); }\n", "assert aborts"),
    ("numbers through the locale", "formats/nc/a.cpp", "double f(const char* a) { return atof(a); }\n",
     "atof depends on the locale"),
    ("clock of the day", "postproc/capi/a.cpp", "auto a = std::chrono::system_clock::now();\n",
     "system_clock makes"),
    ("source in a folder without a row", "kernels/spline/a.h", "#pragma once\n",
     "its folder has no row in layers.txt"),
    ("source one level too deep", "kernels/core/deep/a.h", "#pragma once\n", "its folder has no row"),
    ("source directly on a floor", "kernels/a.h", "#pragma once\n", "its folder has no row"),
    ("two types of one name", "kernels/core/limits.h",
     "#pragma once\nnamespace smoothpost {\nstruct Tree {\n  int a;\n};\n}  // namespace\n",
     "smoothpost::Tree is defined in kernels/core/box.h, too"),
    ("table row without a source", "tests/tools/layers.txt",
     GOOD_TREE["tests/tools/layers.txt"] + "formats/csv | - | - | -\n", "formats/csv has a row but no source"),
    ("table that points up", "tests/tools/layers.txt",
     GOOD_TREE["tests/tools/layers.txt"].replace("kernels/geometry | kernels/core ",
                                                 "kernels/geometry | kernels/core formats/nc "),
     "which is a floor above it"),
    ("table with a circle", "tests/tools/layers.txt",
     GOOD_TREE["tests/tools/layers.txt"].replace("kernels/core     | - ", "kernels/core     | kernels/geometry "),
     "may include itself through others"),
]


def make_tree(folder, files):
    for path, content in files.items():
        file = Path(folder) / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(content, encoding="utf-8")


def self_test():
    failures = []

    def problems_of(extra):
        with tempfile.TemporaryDirectory() as folder:
            make_tree(folder, GOOD_TREE | extra)
            return Tree(folder).check()

    clean = problems_of({})
    if clean:
        failures.append(f"a good tree was refused: {clean}")
    units = {f"kernels/geometry/u{i}.cpp": "#include <CGAL/AABB_tree.h>\n" for i in range(MAX_CGAL_UNITS)}
    cases = [(name, {path: content}, expected) for name, path, content, expected in VIOLATIONS]
    cases.append(("too many units with CGAL", units, "7 translation units include CGAL"))
    for name, extra, expected in cases:
        found = problems_of(extra)
        if not any(expected in problem for problem in found):
            failures.append(f"{name}: expected a problem with '{expected}', got {found}")
        # A violation in a new file must not drag other files in; the table's own may.
        if not any("layers.txt" in path for path in extra) and len(found) != 1:
            failures.append(f"{name}: expected one problem, got {found}")
    for failure in failures:
        print(f"self-test: {failure}")
    print(f"layers_test self-test: {len(cases) + 1} trees, {len(failures)} failures")
    return 1 if failures else 0


def main(arguments):
    if arguments == ["--self-test"]:
        return self_test()
    root = arguments[0] if arguments else Path(__file__).resolve().parents[2]
    tree = Tree(root)
    problems = tree.check()
    for problem in problems:
        print(problem)
    print(f"layers: {len(tree.used)} components, {len(problems)} problems")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
