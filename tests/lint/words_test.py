"""Retired words: docs/glossary.md lists them, with the words to use instead.

    python3 tests/lint/words_test.py SOURCE_DIR

Identifiers are divided at underscores and capitals. In comments, docstrings and pages only uses that have no proper meaning in
English are found: "at least", "least squares" and "most of the marks" are as good there as anywhere.
"""
import ast
import io
import pathlib
import re
import sys
import tokenize

RETIRED = {"least", "most", "share", "shares", "tell", "tells", "told", "hear", "hears", "heard", "ask", "asks", "asked", "say", "says", "said",
           "foretell", "foretells", "foretold", "jury", "voice"}
# Names that contain a retired word in a proper sense, or that belong to interfaces of other programs.
PROPER = {"at_least", "at_least_one", "most_frequent", "most_frequent_of"}
PROSE = [
    re.compile(pattern, re.I) for pattern in (
        r"(?<!at )\bleast\b(?![- ]squares)(?! significant)(?! recently)",
        r"\bshares? of\b",
        r"\bforet(?:ell|ells|old|elling)\b",
        r"\bhears?\b|\bheard\b",
        r"\b(?:is|are|was|were|be) (?:told|asked|said)\b",
        r"\b(?:tells?|says?|asks?) (?:what|which|how|whether|why|where|so|that|nothing|no)\b",
        r"\b(?:without|with) a word\b",
    )
]
CODE = re.compile(r"`[^`]*`|\"[^\"]*\"")  # quoted names and messages, which are not prose
CPP = re.compile(r'(?P<skip>R"(?P<mark>[^()\s\\]*)\((?:.|\n)*?\)(?P=mark)"|"(?:\\.|[^"\\\n])*"|(?<![0-9A-Za-z_])\'(?:\\.|[^\'\\\n])+\')'
                 r"|(?P<comment>//[^\n]*|/\*(?:.|\n)*?\*/)|(?P<name>[A-Za-z_]\w*)")


def parts_of(name):
    return {part.lower() for part in re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", name)}


def is_retired(name):
    return name not in PROPER and bool(parts_of(name) & RETIRED)


def prose_of(text):
    """The retired words in a comment or a line of a page."""
    plain = " ".join(CODE.sub("", text).split())
    return [found.group() for pattern in PROSE for found in pattern.finditer(plain)]


def in_cpp(text):
    for token in CPP.finditer(text):
        words = [token["name"]] if token["name"] and is_retired(token["name"]) else prose_of(token["comment"] or "")
        yield from ((text.count("\n", 0, token.start()) + 1, word) for word in words)


def in_python(text):
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.NAME and is_retired(token.string):
            yield token.start[0], token.string
        if token.type == tokenize.COMMENT:
            yield from ((token.start[0], word) for word in prose_of(token.string))
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef)) and (docstring := ast.get_docstring(node)):
            yield from ((node.body[0].lineno, word) for word in prose_of(docstring))


def in_page(text):
    fenced = False
    for number, line in enumerate(text.splitlines(), 1):
        fenced ^= line.startswith("```")
        if not fenced:
            yield from ((number, word) for word in prose_of(line))


def findings(root):
    readers = {".cpp": in_cpp, ".h": in_cpp, ".py": in_python, ".md": in_page}
    paths = [path for folder in ("lib", "tools", "tests", "docs", "houdini_free_examples") for path in (root / folder).rglob("*")]
    for path in sorted([*paths, *root.glob("*.md")]):
        name = path.relative_to(root).as_posix()
        if path.suffix not in readers or "node_modules" in name or name in ("docs/glossary.md", "tests/lint/words_test.py"):
            continue
        for line, word in readers[path.suffix](path.read_text()):
            yield f"{name}:{line}: {word}"


def self_test():
    assert [word for _, word in in_cpp('// At least one, the least squares.\nint at_least; f("says"); double kMostBytes; // the share of all')] == ["kMostBytes", "share of"]
    assert [word for _, word in in_python('"""What it is told."""\nasked = "told"  # a least bound')] == ["asked", "least", "is told"]
    assert not list(in_page("`least`\n```\nis told\n```\nat least")) and list(in_page("it says whether"))


if __name__ == "__main__":
    self_test()
    found = list(findings(pathlib.Path(sys.argv[1])))
    print("\n".join(found) if found else "no finding")
    sys.exit(1 if found else 0)
