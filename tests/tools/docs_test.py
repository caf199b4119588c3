#!/usr/bin/env python3
"""Checks that the documents and the sources say the same.

  docs_test.py [ROOT]       checks the tree at ROOT:
    - every diagnostic code in the sources has one row in docs/diagnostics.md, and every row a source;
    - every kernel function that "Implements [Key]" something has a row in docs/equations.md, which names
      a declared function and the title of a test that exists; every key is in docs/references.bib;
    - every check that the pipeline makes has a row in docs/guarantees.md, and every row a check;
    - every relative link of every .md file leads to a file, and to a heading where it has an anchor.
  docs_test.py --self-test  builds small trees with one fault each and sees each one reported
"""

import re
import sys
import tempfile
from pathlib import Path
from urllib.parse import unquote

FLOORS = ["kernels", "formats", "machines", "postproc"]
CODE_FAMILIES = "US NC CL CSV STL MF PR RG KN LK CK IN".split()
CODE = re.compile(r'"((?:%s)\d{3})"' % "|".join(CODE_FAMILIES))
CODE_ROW = re.compile(r"^(?:%s)\d{3}$" % "|".join(CODE_FAMILIES))
SKIPPED_FOLDERS = {"build", ".git"}


def sources(root, floors=FLOORS, suffixes=(".h", ".cpp", ".c")):
    for floor in floors:
        for file in sorted((root / floor).rglob("*")):
            if file.is_file() and file.suffix in suffixes:
                yield file


def read(file):
    return file.read_text(encoding="utf-8")


def table_rows(text):
    """(line number, cells) of every table row that is neither a heading nor its underline."""
    for number, line in enumerate(text.splitlines(), 1):
        if not line.startswith("|"):
            continue
        cells = [cell.strip().replace("\\|", "|") for cell in re.split(r"(?<!\\)\|", line.strip())[1:-1]]
        if cells and not set("".join(cells)) <= set("-: "):
            yield number, cells


# --- diagnostics -------------------------------------------------------------------------------------

def check_diagnostics(root):
    problems = []
    used = {}
    for file in sources(root):
        for code in CODE.findall(read(file)):
            used.setdefault(code, file.relative_to(root).as_posix())
    page = root / "docs/diagnostics.md"
    rows = {}
    if page.exists():
        for number, cells in table_rows(read(page)):
            code = cells[0].strip("`")
            if not CODE_ROW.match(code):
                continue
            if code in rows:
                problems.append(f"docs/diagnostics.md:{number}: second row for {code}")
            rows[code] = number
            if len(cells) != 3 or not all(cells):
                problems.append(f"docs/diagnostics.md:{number}: {code} needs a meaning and what to do")
    elif used:
        problems.append("docs/diagnostics.md is missing")
    problems += [f"docs/diagnostics.md: no row for {code} ({used[code]})" for code in sorted(used.keys() - rows)]
    problems += [f"docs/diagnostics.md:{rows[code]}: no source uses {code}" for code in sorted(rows.keys() - used)]
    return problems


# --- equations ---------------------------------------------------------------------------------------

IMPLEMENTS = re.compile(r"Implements\s+((?:\[[^\]]+\][^\[\n]*)+)")
DECLARED = re.compile(r"\b(?:class|struct)\s+(\w+)|(\w+)\s*\(")
BACKTICKED = re.compile(r"`([^`]+)`")
TEST_TITLE = re.compile(r'(?:TEST_CASE|SCENARIO)\s*\(\s*"((?:\\.|[^"\\])*)"')


def implementing_functions(header_text):
    """(name, [keys]) for each comment block that says "Implements [Key]" and what is declared below it."""
    lines = header_text.splitlines()
    comment = []
    for number, line in enumerate(lines):
        stripped = line.strip()
        if stripped.startswith("//"):
            comment.append(stripped.lstrip("/"))
            continue
        block, comment = "\n".join(comment), []
        found = IMPLEMENTS.findall(block)
        if not found:
            continue
        keys = [key for part in found for key in re.findall(r"\[([^\]]+)\]", part)]
        declaration = re.sub(r"template\s*<[^>]*>", "", " ".join(lines[number:number + 4]))
        name = DECLARED.search(declaration)
        yield (name.group(1) or name.group(2)) if name else None, keys


def declared_names(root):
    names = set()
    for file in sources(root, suffixes=(".h",)):
        names |= set(re.findall(r"\b\w+\b", re.sub(r"//[^\n]*", "", read(file))))
    return names


def has_title(titles, wanted):
    """Whether a test has that title; "... the end" stands for a title that ends so."""
    if wanted.startswith("... "):
        return any(title.endswith(wanted[4:]) for title in titles)
    return wanted in titles


def check_equations(root):
    problems = []
    page = root / "docs/equations.md"
    rows = list(table_rows(read(page))) if page.exists() else []
    titles = {title for file in sorted((root / "tests").rglob("*_test.cpp")) for title in TEST_TITLE.findall(read(file))}
    declared = declared_names(root)
    functions = set()
    for number, cells in rows:
        if cells[0].lower().startswith("equation"):
            continue
        where = f"docs/equations.md:{number}"
        if len(cells) != 4:
            problems.append(f"{where}: a row is equation | function | test | difference")
            continue
        named = [part for span in BACKTICKED.findall(cells[1]) for part in re.findall(r"[A-Za-z_]\w*", span)
                 if "/" not in span]
        functions |= set(named)
        if not named or not any(name in declared for name in named):
            problems.append(f"{where}: no header declares {cells[1]}")
        tests = BACKTICKED.findall(cells[2])
        if not tests:
            problems.append(f"{where}: names no test (put its title between backticks)")
        problems += [f"{where}: no test has the title '{title}'" for title in tests if not has_title(titles, title)]
    bibliography = root / "docs/references.bib"
    known_keys = set(re.findall(r"@\w+\{\s*([^,\s]+)\s*,", read(bibliography))) if bibliography.exists() else set()
    for file in sources(root, floors=["kernels"], suffixes=(".h",)):
        path = file.relative_to(root).as_posix()
        for name, keys in implementing_functions(read(file)):
            if name not in functions:
                problems.append(f"{path}: {name} says what it implements but has no row in docs/equations.md")
            problems += [f"{path}: [{key}] is not in docs/references.bib" for key in keys if key not in known_keys]
    return problems


# --- checks ----------------------------------------------------------------------------------------

CHECK_NAME = re.compile(r'(?:\.check\(|\brule\(|\.name =)\s*"([a-z_]+\.?)"')
CHECK_ROW = re.compile(r"^`([a-z_]+\.?)(?:<axis>)?`$")


def check_checks(root):
    page = root / "docs/guarantees.md"
    made = {name for file in sources(root, floors=["postproc"], suffixes=(".cpp",)) for name in CHECK_NAME.findall(read(file))}
    rows = set()
    for _, cells in table_rows(read(page)) if page.exists() else ():
        name = CHECK_ROW.match(cells[0])
        if name and len(cells) == 4:
            rows.add(name.group(1))
    problems = [f"docs/guarantees.md: no row for the check {name}" for name in sorted(made - rows)]
    return problems + [f"docs/guarantees.md: no source makes the check {name}" for name in sorted(rows - made)]


# --- links -------------------------------------------------------------------------------------------

LINK = re.compile(r"(?<!!)\[[^\]]*\]\(([^)\s]+)(?:\s+\"[^\"]*\")?\)|!\[[^\]]*\]\(([^)\s]+)\)")


def without_code(text):
    text = re.sub(r"^```.*?^```", "", text, flags=re.DOTALL | re.MULTILINE)
    return re.sub(r"`[^`\n]*`", "", text)


def anchors(text):
    """The anchors of a page's headings, made as code hosts make them."""
    found = set()
    for heading in re.findall(r"^#{1,6}\s+(.+?)\s*#*$", re.sub(r"^```.*?^```", "", text, flags=re.DOTALL | re.MULTILINE),
                              re.MULTILINE):
        slug = re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")
        number, name = 0, slug
        while name in found:
            number += 1
            name = f"{slug}-{number}"
        found.add(name)
    return found


def check_links(root):
    problems = []
    for file in sorted(root.rglob("*.md")):
        path = file.relative_to(root)
        if path.parts[0] in SKIPPED_FOLDERS:
            continue
        for match in LINK.finditer(without_code(read(file))):
            target = unquote(match.group(1) or match.group(2))
            if re.match(r"[a-z][a-z0-9+.-]*:", target):
                continue
            name, _, anchor = target.partition("#")
            other = (file.parent / name).resolve() if name else file
            if not other.exists():
                problems.append(f"{path.as_posix()}: no such file: {target}")
            elif anchor and other.suffix == ".md" and anchor not in anchors(read(other)):
                problems.append(f"{path.as_posix()}: no such heading: {target}")
    return problems


def check(root):
    root = Path(root).resolve()
    return check_diagnostics(root) + check_equations(root) + check_checks(root) + check_links(root)


# --- self-test ---------------------------------------------------------------------------------------

GOOD_TREE = {
    "kernels/spline/basis.h": "#pragma once\n/// Weights.\n/// Implements [Cai2025] Eq. (6), [Lynch2017] (4.2).\n"
                              "Vector4d basis(const Shape& shape, double t);\n",
    "formats/nc/parser.cpp": 'auto a = "NC101"; // "x"\n',
    "tests/kernels/spline/basis_test.cpp": 'TEST_CASE("basis: mirror symmetry", "[kernels]") {}\n',
    "docs/diagnostics.md": "# Codes\n\n| Code | Meaning | What to do |\n|---|---|---|\n| NC101 | a | b |\n",
    "docs/equations.md": "| Equation | Function | Test | Difference |\n|---|---|---|---|\n"
                         "| [Cai2025] (6) | `basis` | `basis: mirror symmetry`, `... symmetry` | none |\n",
    "postproc/pipeline/verify.cpp": 'auto a = rule("beam_off", 1); b = c.check("limit." + axis, 1); d.name = "gap";\n',
    "docs/guarantees.md": "| Check | Value | Limit | Says |\n|---|---|---|---|\n| `beam_off` | moves | 0 | a |\n"
                          "| `limit.<axis>` | mm | 1 | b |\n| `gap` | mm | 1 | c |\n",
    "docs/references.bib": "@article{Cai2025,\n}\n@book{Lynch2017,\n}\n",
    "README.md": "# House\n\n[codes](docs/diagnostics.md#codes) [web](https://example.org) `[not](alink.md)`\n",
}

FAULTS = [
    ("code without a row", "formats/nc/a.cpp", 'auto a = "NC102";\n', "no row for NC102"),
    ("row without a code", "formats/nc/parser.cpp", "\n", "no source uses NC101"),
    ("two rows", "docs/diagnostics.md", GOOD_TREE["docs/diagnostics.md"] + "| NC101 | c | d |\n",
     "second row for NC101"),
    ("row without advice", "docs/diagnostics.md", GOOD_TREE["docs/diagnostics.md"].replace("| b |", "| |"), "NC101 needs a meaning"),
    ("function without a row", "kernels/spline/b.h", "#pragma once\n/// Implements [Cai2025] Eq. (7).\n"
     "double other(double t);\n", "other says what it implements"),
    ("class without a row", "kernels/spline/b.h", "#pragma once\n/// Implements [Cai2025] Eq. (7).\nclass Other {};\n",
     "Other says what it implements"),
    ("row with an unknown function", "docs/equations.md", GOOD_TREE["docs/equations.md"] +
     "| (7) | `nothing` | `basis: mirror symmetry` | none |\n", "no header declares"),
    ("row with an unknown test", "docs/equations.md",
     GOOD_TREE["docs/equations.md"].replace("basis: mirror symmetry", "basis: symmetry"), "no test has the title"),
    ("row with an unknown end of a title", "docs/equations.md",
     GOOD_TREE["docs/equations.md"].replace("`basis: mirror symmetry`", "`... mirror symmetri`"), "no test has the title"),
    ("row without a test", "docs/equations.md",
     GOOD_TREE["docs/equations.md"].replace("`basis: mirror symmetry`, `... symmetry`", "yes"), "names no test"),
    ("unknown paper", "docs/references.bib", "@article{Cai2025,\n}\n", "[Lynch2017] is not in"),
    ("check without a row", "postproc/pipeline/convert.cpp", 'c.name = "other";\n', "no row for the check other"),
    ("row without a check", "docs/guarantees.md", GOOD_TREE["docs/guarantees.md"] + "| `clearance` | mm | 1 | d |\n",
     "no source makes the check clearance"),
    ("broken link", "README.md", "[codes](docs/codes.md)\n", "no such file: docs/codes.md"),
    ("broken link to a picture", "README.md", "![plot](plot.png)\n", "no such file: plot.png"),
    ("broken anchor", "README.md", "[codes](docs/diagnostics.md#other)\n", "no such heading"),
]


def self_test():
    def problems_of(extra):
        with tempfile.TemporaryDirectory() as folder:
            for path, content in (GOOD_TREE | extra).items():
                file = Path(folder) / path
                file.parent.mkdir(parents=True, exist_ok=True)
                file.write_text(content, encoding="utf-8")
            return check(folder)

    failures = []
    clean = problems_of({})
    if clean:
        failures.append(f"a good tree was refused: {clean}")
    for name, path, content, expected in FAULTS:
        found = problems_of({path: content})
        if len(found) != 1 or expected not in found[0]:
            failures.append(f"{name}: expected one problem with '{expected}', got {found}")
    for failure in failures:
        print(f"self-test: {failure}")
    print(f"docs_test self-test: {len(FAULTS) + 1} trees, {len(failures)} failures")
    return 1 if failures else 0


def main(arguments):
    if arguments == ["--self-test"]:
        return self_test()
    problems = check(arguments[0] if arguments else Path(__file__).resolve().parents[2])
    for problem in problems:
        print(problem)
    print(f"docs: {len(problems)} problems")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
