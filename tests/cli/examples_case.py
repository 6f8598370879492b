"""What docs_test.py and examples_test.py share: the pages, their blocks, and the checks of an example script.
Standard library only.
"""
import pathlib
import re
import struct

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGES = [*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").rglob("*.md")), ROOT / "houdini_free_examples/README.md"]


def blocks(page, *languages):
    found = re.findall(r"^```(\w*)\n(.*?)^```$", page.read_text(), re.M | re.S)
    return [text for name, text in found if not languages or name in languages]


def examples_in(block):
    """Names of the example scripts that the block runs."""
    return re.findall(r"\bbash houdini_free_examples/(\d\w*\.sh)", block)


def check_example(test, done, out, folder):
    """Checks what an example script printed, and that the files that it names are there.

    `out`: its COVOL_OUT, relative to `folder`.
    """
    test.assertNotIn("warning", done.stderr)
    output = done.stdout.split("== results", 1)
    test.assertEqual(len(output), 2, done.stdout)
    named = {folder / path for path in re.findall(rf"(?<![\w/.-]){re.escape(str(out))}/[\w/.-]*\w", output[1])}
    test.assertTrue(named, "no file is named")
    for path in named:
        test.assertTrue(path.is_file() and path.stat().st_size > 0, f"{path} is named, but not there")
    pictures = {picture for path in named for picture in path.parent.rglob("*.png")}
    test.assertTrue(pictures, "no picture")
    for picture in pictures:
        data = picture.read_bytes()
        test.assertEqual(data[:8], b"\x89PNG\r\n\x1a\n")
        width, height = struct.unpack(">II", data[16:24])
        # A PNG of a single colour has far less than a byte for 100 pixels.
        test.assertGreater(len(data), width * height / 100, f"{picture} is empty")
