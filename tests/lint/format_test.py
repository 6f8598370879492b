"""Every C++ source is formatted according to .clang-format. Exit code 77 (skipped) if clang-format 14 is not installed: other
versions differ in details.

    python3 tests/lint/format_test.py SOURCE_DIR [--write]
"""
import pathlib
import shutil
import subprocess
import sys

SKIPPED = 77
FOLDERS = ["lib", "tools", "tests", "houdini_free_examples"]


def formatter():
    for name in ["clang-format-14", "clang-format"]:
        if shutil.which(name) and " 14." in subprocess.run([name, "--version"], capture_output=True, text=True).stdout:
            return name
    return None


def main():
    root = pathlib.Path(sys.argv[1])
    program = formatter()
    if program is None:
        print("SKIPPED: clang-format 14 is not installed")
        return SKIPPED
    files = [path for folder in FOLDERS for ending in ["*.h", "*.cpp"] for path in sorted((root / folder).rglob(ending))]
    if len(files) < 100:
        sys.exit(f"found {len(files)} sources only below {root}")
    mode = ["-i"] if "--write" in sys.argv[2:] else ["--dry-run", "--Werror"]
    if subprocess.run([program, *mode, *files]).returncode != 0:
        sys.exit("not formatted: run python3 tests/lint/format_test.py . --write")
    print(f"{len(files)} sources")


if __name__ == "__main__":
    sys.exit(main())
