"""Every source, function and test that docs/method.md names exists.

    python3 tests/lint/docs_test.py SOURCE_DIR
"""
import pathlib
import re
import sys


def findings(root):
    text = (root / "docs/method.md").read_text()
    rows = [[cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]] for line in text.splitlines() if line.startswith("|") and "`" in line]
    if len(rows) < 20:
        yield f"docs/method.md: expected a table, found {len(rows)} rows"
    for _, sources, functions, tests in rows:
        code = ""
        for source in re.findall(r"`([\w/.]+)`", sources):
            path = root / "lib/src" / source
            if not path.exists():
                yield f"docs/method.md: lib/src/{source}: no such file"
            else:
                code += path.read_text()
        for function in re.findall(r"`([\w:]+)`", functions):
            if not re.search(rf"\b{function}\b\s*(\(|\{{|:|\bfinal)|(class|struct) {function}\b", code):
                yield f"docs/method.md: {function} is not in {sources}"
        if not re.search(r"`", tests):
            yield f"docs/method.md: {sources}: no test"
    for path in re.findall(r"`((?:unit|property|convergence)/[\w/.]+)`", text):
        if not (root / "tests" / path).exists():
            yield f"docs/method.md: tests/{path}: no such file"
    named = "".join(path.read_text() for path in (root / "tests").rglob("*_test.cpp"))
    for name in (name for line in text.splitlines() for name in re.findall(r'"([^"]*)"', line)):
        if name != "The paper" and f'TEST_CASE("{name}"' not in named:
            yield f"docs/method.md: no test is called '{name}'"


if __name__ == "__main__":
    found = list(findings(pathlib.Path(sys.argv[1])))
    print("\n".join(found) if found else "no finding")
    sys.exit(1 if found else 0)
