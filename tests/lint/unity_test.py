"""Names in unnamed namespaces differ within a folder: COVOL_UNITY compiles the sources of a folder as one.

    python3 tests/lint/unity_test.py SOURCE_DIR

Overloads may have the same name, and aliases may denote the same type. A function that hides others of its name is only detected
by the compiler: `cmake --preset default -DCOVOL_UNITY=ON`.
"""
import collections
import pathlib
import re
import sys

FOLDERS = ["lib/src", "tools/covol"]
NOISE = re.compile(r'//[^\n]*|/\*.*?\*/|R"(\w*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])\'', re.S)
PATTERNS = [  # definitions at the top level of an unnamed namespace, after every body has been replaced by {}
    re.compile(r"\b(?:class|struct|enum(?:\s+class)?|union)\s+(?P<name>\w+)[^;(){}]*\{\}"),
    re.compile(r"\busing\s+(?P<name>\w+)\s*=(?P<more>[^;]*)"),
    re.compile(r"\b(?P<name>\w+)\s*\((?P<more>[^;{}]*)\)\s*(?:const|noexcept|->[^{};]*)?\s*\{\}"),
    re.compile(r"(?P<name>\bk[A-Z]\w*)\s*(?:\[[^\]]*\])?\s*(?:=|\{\})"),
]


def inner(text, begin):
    """The text between the brace before `begin` and the matching one, with inner bodies replaced by {}."""
    out, depth = [], 1
    for c in text[begin:]:
        depth += {"{": 1, "}": -1}.get(c, 0)
        if depth == 0:
            break
        if depth == 1 or (c == "{" and depth == 2):
            out.append(c)
    return "".join(out)


def names(source):
    """The definitions in a source's unnamed namespaces: (name, properties that may distinguish two of that name)."""
    text = NOISE.sub(lambda m: "" if m.group().startswith("/") else '""', source)
    for space in re.finditer(r"namespace\s*\{", text):
        body = inner(text, space.end())
        for pattern in PATTERNS:
            for found in pattern.finditer(body):
                parts = found.groupdict()
                yield parts["name"], re.sub(r"\s+", " ", parts.get("more") or "").strip(), pattern is PATTERNS[1]


def findings(root):
    sources = [path for folder in FOLDERS for path in sorted((root / folder).rglob("*.cpp"))]
    if len(sources) < 100:
        yield f"{root}: expected the sources of covol"
    seen = collections.defaultdict(dict)
    for path in sources:
        for name, more, alias in names(path.read_text()):
            others = seen[path.parent, name]
            same = others.get(more)
            clash = same if not alias else next((other for text, other in others.items() if text != more), None)
            if clash and clash != path:
                yield f"{path.relative_to(root)}: {name} is in {clash.name}, too: COVOL_UNITY compiles both as one; rename one"
            others[more] = path


def main():
    example = "namespace {\nstruct A { int b; };\nint f(int x) {\n  return x; }\nconstexpr int kC = 1;\n}"
    if {name for name, _, _ in names(example)} != {"A", "f", "kC"}:
        sys.exit("unity_test: it finds no names")
    found = list(findings(pathlib.Path(sys.argv[1])))
    print("\n".join(found))
    sys.exit(bool(found))


main()
