"""Every class of tests/cli that has tests is run: tests/CMakeLists.txt names it, or its whole file.

    python3 tests/lint/listed_test.py SOURCE_DIR
"""
import ast
import pathlib
import re
import sys


def findings(root):
    # Comments are removed: a test named there is not run.
    text = re.sub(r"#.*", "", (root / "tests/CMakeLists.txt").read_text())
    # In a loop of CMake, the class of a test is a variable: "programs_test.${group}".
    listed = set(re.findall(r"(?<![\w/])[a-z0-9_]+_test(?:\.[A-Za-z]\w*)?(?=[\s)]|\.\$)", text))
    files = sorted((root / "tests/cli").glob("*_test.py"))
    if len(files) < 20:
        yield f"{root}: expected the tests of the command line"
    for path in files:
        for node in ast.parse(path.read_text()).body:
            if not isinstance(node, ast.ClassDef) or path.stem in listed:
                continue
            has_tests = any(isinstance(part, ast.FunctionDef) and part.name.startswith("test") for part in node.body)
            if has_tests and f"{path.stem}.{node.name}" not in listed:
                yield f"{path.relative_to(root)}:{node.lineno}: {node.name} is in no list of tests/CMakeLists.txt"


found = list(findings(pathlib.Path(sys.argv[1])))
print("\n".join(found) or "no finding")
sys.exit(bool(found))
