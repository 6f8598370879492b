"""The library speaks of fields, the command line of flags: no file of lib/ names a flag, and tools/ has one for each field.

    python3 tests/lint/flags_test.py SOURCE_DIR
"""
import pathlib
import re
import sys

TOKEN = re.compile(r'"(?:[^"\\\n]|\\.)*"|\'(?:[^\'\\\n]|\\.)+\'|//[^\n]*|/\*.*?\*/', re.S)
FLAG = re.compile(r"(?<![-!<])--[a-z]|(?:^| )--$")  # "--" alone is put before a name
FIELD = re.compile(r"`([a-z_]+)(?=`| = )|(?:^|, )([a-z_]{2,}) = ")
PUT_TOGETHER = {"channel", "frame"}  # by image/image.cpp, so that no string has them as a whole
TABLE = re.compile(r'\{"([a-z_]+)", "(--[a-z-]+)"\}')


def tokens(text):
    """Strings, without their quotes, and comments, each with its line."""
    for match in TOKEN.finditer(text):
        token = match.group()
        if token[0] != "'":
            yield text.count("\n", 0, match.start()) + 1, token[1:-1] if token[0] == '"' else token, token[0] == '"'


def findings(root):
    sources = sorted((root / "lib").rglob("*.h")) + sorted((root / "lib").rglob("*.cpp"))
    if len(sources) < 100:
        yield f"{root}: expected the sources of covol"
    table = dict(TABLE.findall((root / "tools/covol/cli/option_names.cpp").read_text()))
    named = set(PUT_TOGETHER)
    for path in sources:
        for line, token, is_string in tokens(path.read_text()):
            where = f"{path.relative_to(root)}:{line}"
            if any(FLAG.search(part) for part in token.splitlines()):
                yield f"{where}: names a flag; name the field, as covol/option_names.h tells: {token}"
            for field in (match[1] or match[2] for match in FIELD.finditer(token) if is_string):
                named.add(field)
                if field not in table:
                    yield f"{where}: no flag for the field {field} in tools/covol/cli/option_names.cpp"
    tools = "".join(path.read_text() for path in (root / "tools/covol").rglob("*.cpp") if path.stem != "option_names")
    for field, flag in table.items():
        if f'"{flag}' not in tools:
            yield f"tools/covol/cli/option_names.cpp: no command has {flag}"
        if field not in named:
            yield f"tools/covol/cli/option_names.cpp: the library never names {field}"


def self_test():
    """The patterns find what they are for."""
    found = list(tokens('a = "x // y";  // z\nb = \'"\'; /* q */ c("k");'))
    assert found == [(1, "x // y", True), (1, "// z", False), (2, "/* q */", False), (2, "k", True)], found
    for text in ("give --roi", " with --", "--spacing sx", "(--roi)"):
        assert FLAG.search(text), text
    for text in ("-->", "<!--", "// ---- reading -----", "a - b"):
        assert not FLAG.search(text), text
    fields = [match[1] or match[2] for match in FIELD.finditer("; `space = Index, order = ZYX` or `roi` (`x y`) g = 1")]
    assert fields == ["space", "order", "roi"], fields


if __name__ == "__main__":
    self_test()
    found = list(findings(pathlib.Path(sys.argv[1])))
    print("\n".join(found) if found else "no finding")
    sys.exit(1 if found else 0)
