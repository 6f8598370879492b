"""Fills the options of segment() and reconstruct() into covol/__init__.pyi, from the module's own table.

    PYTHONPATH=BUILD/python /usr/bin/python3 tools/python/write_stub.py           says whether the stub is up to date
    PYTHONPATH=BUILD/python /usr/bin/python3 tools/python/write_stub.py --write   fills them in
"""
import pathlib
import re
import sys

from covol import _covol

STUB = pathlib.Path(__file__).parent / "covol/__init__.pyi"
BEGIN, END = "    # options, from covol.options()\n", "    # end of options\n"


def parameter(name, type_name, default):
    text = repr(default).replace("'", '"')
    return f"    {name}: {type_name} = {text},\n"


def filled(text):
    lines = sorted(parameter(*option) for option in _covol.list_options())
    return re.sub(f"{BEGIN}.*?{END}", lambda _: BEGIN + "".join(lines) + END, text, flags=re.S)


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
