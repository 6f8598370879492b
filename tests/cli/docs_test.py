"""The commands in README.md and docs work as printed, and all options that they name exist. Standard library only.

    COVOL=build/bin/covol python3 -m unittest tests/cli/docs_test.py

Blocks that begin with ```bash are run, those of a page one after the other, in a folder that contains the sample data and an empty
folder `out`; the program is on the path as covol. Blocks that begin with ```sh need the data of COVOL_DATA and are run if it is
set. Other blocks are only checked. The commands make the pictures of the pages: if COVOL_PICTURES is set to a folder, the pictures
are stored there. A block that runs an example script is checked as in examples_test.py, which leaves this script out.
"""
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from examples_case import PAGES, ROOT, blocks, check_example, examples_in  # noqa: E402

COVOL = pathlib.Path(os.environ.get("COVOL", "build/bin/covol")).resolve()


def without_data(text):
    """A page without the blocks that need COVOL_DATA, and without their pictures."""
    return re.sub(r"^```sh\n.*?^```\n\n!\[.*?\n", "", text, flags=re.M | re.S)


class Pages(unittest.TestCase):
    def run_page(self, page):
        folder = pathlib.Path(tempfile.mkdtemp(prefix="covol-docs-"))
        self.addCleanup(shutil.rmtree, folder)
        for name in ("houdini_free_examples", "tests"):
            (folder / name).symlink_to(ROOT / name)
        for name in ("bin", "out"):
            (folder / name).mkdir()
        (folder / "bin/covol").symlink_to(COVOL)
        path = f"{folder / 'bin'}:/usr/bin:{os.environ['PATH']}"
        has_data = bool(os.environ.get("COVOL_DATA"))
        for block in blocks(page, "bash", *["sh"] * has_data):
            done = subprocess.run(["bash", "-euo", "pipefail", "-c", block], capture_output=True, text=True, timeout=300, cwd=folder,
                                  env={**os.environ, "PATH": path})
            self.assertEqual(done.returncode, 0, f"{block}\n{done.stdout}\n{done.stderr}")
            if examples := examples_in(block):
                self.assertEqual(len(examples), 1, block)
                check_example(self, done, "out", folder)
        text = page.read_text() if has_data else without_data(page.read_text())
        for picture in re.findall(r"\]\([./]*pictures/([\w.]+)\)", text):
            made = folder / "out" / picture
            self.assertTrue(made.exists(), f"{page.relative_to(ROOT)}: no command makes {picture}")
            if "COVOL_PICTURES" in os.environ:
                shutil.copyfile(made, pathlib.Path(os.environ["COVOL_PICTURES"]) / picture)

    def test_pictures_are_small_and_shown(self):
        shown = {name for page in PAGES for name in re.findall(r"pictures/([\w.]+\.png)", page.read_text())}
        for picture in (ROOT / "docs/pictures").iterdir():
            self.assertLessEqual(picture.stat().st_size, 200_000, picture.name)
            self.assertIn(picture.name, shown)

    def test_options_exist(self):
        described = json.loads(subprocess.run([COVOL, "--describe-options"], capture_output=True, text=True, check=True).stdout)
        names = lambda groups: {name for g in groups for o in g["options"] for name in o["names"].split(", ")}
        common = names(described["common"])
        options = {c["name"]: names(c["groups"]) | common for c in described["commands"]}
        every = set().union(*options.values())
        for page in PAGES:
            for block in blocks(page):
                for line in re.sub(r"\\\n", " ", block).splitlines():
                    if command := re.match(r"\s*covol (?:brick )?(?:plan )?([a-z]\w*)", line):
                        # covol brick run and covol brick join accept the options of segment, the command that was
                        # planned, too.
                        known = options["segment" if command[1] in ("run", "join") else command[1]]
                        for flag in re.findall(r"(?<=\s)--?[a-z][\w-]*", line.split("#")[0]):
                            self.assertIn(flag, known, f"{page.relative_to(ROOT)}: {line}")
            prose = re.sub(r"^```.*?^```$", "", page.read_text(), flags=re.M | re.S)
            for flag in re.findall(r"(?<=`)--[a-z][\w-]*", prose):
                if not page.name.startswith(("benchmarks", "CONTRIBUTING")):  # these pages also name options of other programs
                    self.assertIn(flag, every, f"{page.relative_to(ROOT)}")

    def test_links_lead_somewhere(self):
        for page in PAGES:
            for target in re.findall(r"\]\(([^)#\s]+)(?:#[\w-]*)?\)", page.read_text()):
                if not target.startswith("http"):
                    self.assertTrue((page.parent / target).exists(), f"{page.relative_to(ROOT)}: {target}")


for path in PAGES:
    if blocks(path, "bash"):
        name = "test_" + re.sub(r"\W", "_", str(path.relative_to(ROOT).with_suffix("")))
        setattr(Pages, name, lambda self, path=path: self.run_page(path))

if __name__ == "__main__":
    unittest.main()
