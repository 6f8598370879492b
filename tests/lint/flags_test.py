"""The library has options, the command line has flags: no file of lib/ names a flag, and every name of an option in lib/ is that
of an option. An option has one row in one table, and its name occurs elsewhere only if it is used there.

    python3 tests/lint/flags_test.py SOURCE_DIR           prints what is wrong
    python3 tests/lint/flags_test.py SOURCE_DIR NAME...   lists the places where an option's name occurs
"""
import pathlib
import re
import sys

TOKEN = re.compile(r'"(?:[^"\\\n]|\\.)*"|\'(?:[^\'\\\n]|\\.)+\'|//[^\n]*|/\*.*?\*/', re.S)
# Matches "--x", and a "--" at the end of a string, to which a name is appended.
FLAG = re.compile(r"(?<![-!<])--[a-z]|(?:^| )--$")
FIELD = re.compile(r"`([a-z_]+)(?=`| = )|(?:^|, )([a-z_]{2,}) = ")
ROW = re.compile(r'Option\{\s*"([a-z_]+)",\s*&')
# Options that are not in a table of a struct of options, so that ROW does not find them.
BY_HAND = {"checkpoint", "checkpoint_every", "contours", "guess", "inside", "outside", "resume", "structure_column"}
# Examples of options of every kind that must be named only in their row of a table, from which everything else is
# generated. Other options may also be named where options depend on each other, where a report has a result of the same
# name, and in messages that recommend them.
PLAIN = ("guess_weight", "epsilon", "edge_epsilon", "solver_tolerance", "coarse_levels", "guess_radius", "hole_distance", "contour_curve",
         "points_scale", "points_channels", "painted_outside", "correct_level_shift", "zoom", "seed")


def tokens(text):
    """Strings, without their quotes, and comments, each with its line."""
    for match in TOKEN.finditer(text):
        token = match.group()
        if token[0] != "'":
            yield text.count("\n", 0, match.start()) + 1, token[1:-1] if token[0] == '"' else token, token[0] == '"'


def sources(root, *folders):
    return sorted(path for folder in folders for end in ("*.h", "*.cpp") for path in (root / folder).rglob(end))


def options(root):
    return {name for path in sources(root, "lib/include", "tools") for name in ROW.findall(path.read_text())}


def places(root, names):
    """Strings in the sources that are an option's name or contain its flag: (name, file:line)."""
    flags = {name: re.compile(rf"--{name.replace('_', '-')}(?![a-z-])") for name in names}
    for path in sources(root, "lib", "tools"):
        text = path.read_text()
        for line, token, is_string in tokens(text):
            for name in names if is_string else []:
                if token == name or flags[name].search(token):
                    yield name, f"{path.relative_to(root)}:{line}"


def findings(root):
    known = options(root)
    if len(sources(root, "lib")) < 100 or len(known) < 50:
        yield f"{root}: expected the sources of covol"
    for path in sources(root, "lib"):
        for line, token, is_string in tokens(path.read_text()):
            where = f"{path.relative_to(root)}:{line}"
            if any(FLAG.search(part) for part in token.splitlines()):
                yield f"{where}: names a flag; name the option, as covol/option_names.h tells: {token}"
            for field in (match[1] or match[2] for match in FIELD.finditer(token) if is_string):
                if field not in known and field not in BY_HAND:
                    yield f"{where}: {field} is in no table of options"
    tools = "".join(path.read_text() for path in sources(root, "tools/covol"))
    for name in sorted(BY_HAND):
        if f'"--{name.replace("_", "-")}"' not in tools:
            yield f"tests/lint/flags_test.py: no command has the flag of {name}"
    stands = {name: [] for name in PLAIN}
    for name, where in places(root, stands):
        stands[name].append(where)
    for name, where in stands.items():
        if len(where) != 1 or "/include/covol/" not in where[0]:
            yield f"{name}: expected its row alone, but it stands in {', '.join(where)}"


def self_test():
    """Checks that the patterns match what they should."""
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
    root, names = pathlib.Path(sys.argv[1]), sys.argv[2:]
    if names:
        print("\n".join(f"{name}: {where}" for name, where in places(root, names)))
        sys.exit(0)
    found = list(findings(root))
    print("\n".join(found) if found else "no finding")
    sys.exit(1 if found else 0)
