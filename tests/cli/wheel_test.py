"""The wheel that tools/packaging/wheel.py makes: valid, and after `pip install` independent of this build.

    COVOL_BUILD=build COVOL=build/bin/covol python3 -m unittest tests/cli/wheel_test.py

COVOL_OTHER_PYTHONS names further Pythons with numpy, separated by colons, into which it is installed.
"""
import ast
import base64
import csv
import hashlib
import json
import os
import pathlib
import re
import shutil
import sys
import tempfile
import unittest
import zipfile

from packages_test import completed

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ.get("COVOL_BUILD", "build")).resolve()
COVOL = pathlib.Path(os.environ.get("COVOL", BUILD / "bin/covol")).resolve()
PYTHONS = [sys.executable, *filter(None, os.environ.get("COVOL_OTHER_PYTHONS", "").split(":"))]
USED = pathlib.Path(__file__).with_name("wheel_used.py")


def run(*words, **more):
    return completed(*words, **more).stdout


@unittest.skipUnless(shutil.which("patchelf") and shutil.which("dpkg"), "needs patchelf and dpkg")
class Wheel(unittest.TestCase):
    @classmethod
    def make(cls, output):
        run("/usr/bin/python3", ROOT / "tools/packaging/wheel.py", cls.bundle, "--output", output, "--level", "1")

    @classmethod
    def setUpClass(cls):
        cls.work = pathlib.Path(tempfile.mkdtemp(prefix="covol-wheel-"))
        cls.addClassCleanup(shutil.rmtree, cls.work)
        run("cmake", "--build", BUILD, "--target", "covol_packed")
        run("/usr/bin/python3", ROOT / "tools/packaging/bundle.py", BUILD, "--output", cls.work, "--level", "0")
        [cls.bundle] = cls.work.glob("*.tar.xz")
        cls.make(cls.work)
        [cls.wheel] = cls.work.glob("*.whl")
        cls.zip = zipfile.ZipFile(cls.wheel)
        cls.addClassCleanup(cls.zip.close)

    def text(self, name):
        [found] = [n for n in self.zip.namelist() if n.endswith(".dist-info/" + name)]
        return self.zip.read(found).decode()

    def test_its_own_description(self):
        version, tag = re.fullmatch(r"covol-([0-9.]+)-(py3-none-manylinux_2_\d+_\w+)\.whl", self.wheel.name).groups()
        self.assertIn(f"Tag: {tag}\n", self.text("WHEEL"))
        self.assertIn("Root-Is-Purelib: false\n", self.text("WHEEL"))
        for line in (f"Version: {version}", "Name: covol", "Requires-Python: >=3.9", "Requires-Dist: numpy"):
            self.assertIn(line + "\n", self.text("METADATA"))
        recorded = {row[0]: row[1:] for row in csv.reader(self.text("RECORD").splitlines())}
        self.assertEqual(set(recorded), set(self.zip.namelist()))
        for name, (digest, size) in recorded.items():
            data = self.zip.read(name)
            if not name.endswith("/RECORD"):
                expected = "sha256=" + base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
                self.assertEqual((digest, size), (expected, str(len(data))), name)

    def test_nothing_of_this_machine(self):
        for entry in self.zip.infolist():
            self.assertFalse(entry.filename.startswith("/") or ".." in entry.filename.split("/"), entry.filename)
            self.assertNotIn((entry.external_attr >> 16) & 0o170000, (0o120000,), entry.filename)  # no symbolic links
            if entry.filename.endswith((".py", ".pyi", "RECORD", "FILES.txt")):
                self.assertNotIn(str(BUILD), self.zip.read(entry).decode(), entry.filename)
        listed = self.zip.read("covol/program/share/doc/covol/FILES.txt").decode().splitlines()[1:]
        there = {n.removeprefix("covol/program/") for n in self.zip.namelist()}
        self.assertLessEqual({row.split("\t")[0] for row in listed}, there)
        self.assertTrue(any(row.startswith("lib/libtbb.so.12\t") for row in listed))

    def test_every_python_from_3_9_on_can_read_it(self):
        for name in self.zip.namelist():
            if re.fullmatch(r"covol/\w+\.py", name):
                ast.parse(self.zip.read(name), name, feature_version=(3, 9))
        for version in ("3.9", "3.13"):
            folder = self.work / version
            run(sys.executable, "-m", "pip", "install", "--quiet", "--no-index", "--no-deps", "--only-binary=:all:", "--python-version",
                version, "--platform", re.search(r"manylinux_\w+", self.wheel.name)[0],
                "--target", folder, self.wheel)
            self.assertTrue(os.access(folder / "covol/program/bin/covol", os.X_OK))

    def test_the_same_bundle_gives_the_same_bytes(self):
        again = self.work / "again"
        self.make(again)
        self.assertEqual((again / self.wheel.name).read_bytes(), self.wheel.read_bytes())

    def test_installed_and_used(self):
        for n, python in enumerate(PYTHONS):
            with self.subTest(python):
                home = self.work / f"venv{n}"
                run(python, "-m", "venv", "--system-site-packages", home)
                environment = {"PATH": f"{home}/bin:/usr/bin:/bin", "HOME": str(self.work), "PYTHONDONTWRITEBYTECODE": "1"}
                run(home / "bin/pip", "install", "--quiet", "--no-index", self.wheel, env=environment)
                self.assertRegex(run(home / "bin/covol", "--version", env=environment), r"^covol \d")
                folder = self.work / f"used{n}"
                folder.mkdir()
                # The expected result: the same job run by the program of the build.
                run(COVOL, "phantom", "sphere", "--size", 40, "--count", 120, "-o", "p.nrrd", "--points", "p.csv", cwd=folder)
                run(COVOL, "segment", "p.nrrd", "--points", "p.csv", "-o", "s.vdb", "--mesh", "s.ply", "--mask", "s.nrrd", "--json", "s.json",
                    cwd=folder)
                output = json.loads(run(home / "bin/python", USED, cwd=folder, env=environment))
                self.assertTrue(pathlib.Path(output["package"]).is_relative_to(home), output)
                self.assertEqual([name for name, fine in output["checks"].items() if not fine], [])
                self.assertGreater(len(output["checks"]), 25)
                run(home / "bin/pip", "uninstall", "--quiet", "--yes", "covol", env=environment)
                self.assertFalse((home / "bin/covol").exists())


if __name__ == "__main__":
    unittest.main()
