"""Writes the options of segment() and reconstruct() into covol/__init__.pyi, from the module's own table.

    PYTHONPATH=BUILD/python /usr/bin/python3 tools/python/write_stub.py           checks whether the file is up to date
    PYTHONPATH=BUILD/python /usr/bin/python3 tools/python/write_stub.py --write   updates it
"""
import pathlib
import re
import sys

sys.path.pop(0)  # this folder contains the sources of the package without the extension module
from covol import _covol

STUB = pathlib.Path(__file__).parent / "covol/__init__.pyi"
BEGIN, END = "    # options, from covol.options()\n", "    # end of options\n"


def parameter(name, type_name, default):
    text = repr(default).replace("'", '"')
    return f"    {name}: {type_name} = {text},\n"


def filled(text):
    lines = sorted(parameter(*option) for option in _covol.list_options())
    without_image = [line.replace("rho: float = 1.0", "rho: float = 0.0") for line in lines]
    blocks = iter([lines, without_image])  # options of segment(), then of reconstruct()
    result, count = re.subn(f"{re.escape(BEGIN)}.*?{END}", lambda _: BEGIN + "".join(next(blocks)) + END, text, flags=re.S)
    if count != 2:
        sys.exit(f"{STUB}: expected two places for options, found {count}")
    return result


def main():
    text = STUB.read_text()
    if filled(text) == text:
        return 0
    if "--write" in sys.argv:
        STUB.write_text(filled(text))
        return 0
    print(f"{STUB}: the options are not the module's; {__file__} --write fills them in")
    return 1


if __name__ == "__main__":
    sys.exit(main())
