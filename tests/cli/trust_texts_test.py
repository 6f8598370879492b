"""Untrusted texts: configurations and names are data, and cannot cause actions that the user did not request.

    COVOL=build/bin/covol python3 -m unittest tests/cli/trust_texts_test.py
"""
import json
import os
import resource
import shutil
import subprocess
import unittest

import pyopenvdb as vdb

from covol_case import CENTER, COVOL, sphere_points, write_xyz
from trust_case import ESC, STEERS, Stranger


class Configurations(Stranger):
    VALUES = ["$(touch stolen)", "`touch stolen`", "a\"b", "a'b", "a\\b", "two\nlines", "tab\there", ESC, "#no comment", "a, b", "[c]d", "=", " blank ",
              "ü\u202e", "$HOME", "!!", "true.csv", "5", "'", "\"", "\\", "\\n", "0x10", "a;touch stolen", "\x7f", "latin\udce9"]

    def test_what_is_saved_reads_back(self):
        for value in self.VALUES:
            with self.subTest(value):
                for path in ("c.toml", "d.toml"):
                    (self.out / path).unlink(missing_ok=True)
                name = f"m{value}.xyz"
                shutil.copy(self.points, os.path.join(os.fsencode(self.out), os.fsencode(name)))
                words = ["segment", "ball.nrrd", "--init", "tag", "--max-steps", "1", "-o", "c.vdb", "--quiet"]
                given = ["./" + name, "ball.xyz"]
                subprocess.run([COVOL, *words, "--points", *given, "--save-config", "c.toml"], cwd=self.out, check=True)
                subprocess.run([COVOL, "segment", "--config", "c.toml", "--quiet", "--save-config", "d.toml", "--json", "r.json"], cwd=self.out, check=True)
                # A configuration that was saved from a read one has the same bytes.
                self.assertEqual((self.out / "c.toml").read_bytes(), (self.out / "d.toml").read_bytes())
                printed = json.loads((self.out / "r.json").read_bytes().decode(errors="replace"))["options"]["points"]
                self.assertEqual(len(printed), 2)
                before = self.state()
                for shell in ("sh", "bash"):
                    subprocess.run([shell, "-c", ". ./c.toml"], cwd=self.out, capture_output=True, stdin=subprocess.DEVNULL, timeout=30)
                self.assertEqual(self.state(), before)
                os.unlink(os.path.join(os.fsencode(self.out), os.fsencode(name)))

    def test_toml_reads_it_too(self):
        try:
            import tomllib
        except ImportError:
            self.skipTest("no tomllib")
        shutil.copy(self.points, self.out / "$(x)\\\"\n.xyz")
        self.run_covol("segment", "ball.nrrd", "--points", "a=$(x)\\\"\n.xyz", "a=ball.xyz", "--theta", "0.5", "-o", "c.vdb", "--save-config", "c.toml")
        self.assertEqual(tomllib.loads((self.out / "c.toml").read_text()),
                         {"image": "ball.nrrd", "points": ["a=$(x)\\\"\n.xyz", "a=ball.xyz"], "output": "c.vdb", "theta": 0.5})

    def read(self, text, *more, code=0):
        (self.out / "c.toml").write_bytes(text if isinstance(text, bytes) else text.encode())
        words = ["segment", "ball.nrrd", "-o", "c.vdb", "--max-steps", "1", "--init", "tag", "--config", "c.toml", "--json", "r.json", *more]
        done = self.run_covol(*words, code=code)
        return json.loads((self.out / "r.json").read_text())["options"] if code == 0 else done.stderr

    def test_forms(self):
        for text in ('points = "ball.xyz"', "points='ball.xyz'", "points = ball.xyz # a comment", '\ufeff; INI\n[segment]\npoints=ball.xyz\n',
                     'points = [ "ball.xyz" , ]', 'points = [\n  # first\n  "ball.xyz", # and last\n]\n', 'segment.points = "ball.xyz"',
                     '[mesh]\nfar = [1]\n["segment"]\n"points" = "ball.xyz"', 'points = "b\\u0061ll.x\\U00000079z"\r\n', '[[segment]]\npoints = ball.xyz'):
            with self.subTest(text):
                self.assertEqual(self.read(text)["points"], ["ball.xyz"])
        options = self.read('points = ball.xyz\nhalf\nquiet = true\ntheta = 0.5')
        self.assertEqual((options["half"], options["theta"]), (True, 0.5))
        shutil.copy(self.points, self.out / "b.xyz")
        for text in ("points = ball.xyz, b.xyz", "points = ball.xyz b.xyz", 'points = "ball.xyz"\npoints = "b.xyz"', "points = ['ball.xyz', b.xyz]"):
            with self.subTest(text):
                self.assertEqual(self.read(text)["points"], ["ball.xyz", "b.xyz"])

    def test_mistakes_are_reported_with_their_line(self):
        for text in ('\npoints = "ball.xyz', 'points = "a\\qb"', "points = [", "points = [[1]]", "[segment", "points = [1 2]", "= 3", '\npoints = "a" x\n= 1',
                     'points = "\\u0000"', 'points = "\\ud800"', "points = []", "[[[segment]]]", 'points = """a"""', "config = other.toml", "save-config = stolen"):
            with self.subTest(text):
                error = self.read(text, code=2)
                self.assertRegex(error, "line [0-9]|configurable|config")
                self.assertNotIn("stolen", self.files())

    def test_small_files_take_little_memory(self):
        for name, text in {"nested": "a." * 100_000 + "b = 1", "section": "[" + "a." * 100_000 + "b]", "brackets": "[" * 200_000, "list": "points = " + "[" * 200_000,
                           "sections": "".join(f"[{'a.' * (n % 200)}b{n}]\n" for n in range(2000)), "quotes": "points = " + "\"a\"," * 50_000,
                           "blanks": "theta = 0.5\n" + " \n" * 100_000, "zeros": b"\0" * 200_000, "escapes": 'points = "' + "\\u0061" * 30_000}.items():
            with self.subTest(name):
                (self.out / "c.toml").write_bytes(text if isinstance(text, bytes) else text.encode())
                done = subprocess.run([COVOL, "segment", "ball.nrrd", "-o", "c.vdb", "--config", "c.toml", "--quiet"], cwd=self.out, capture_output=True, timeout=60,
                                      preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30)))
                self.assertIn(done.returncode, (0, 2, 3, 4), done.stderr[:500])
                self.assertLess(len(done.stderr), 100_000)
        with open(self.out / "c.toml", "wb") as file:
            file.truncate(40 << 30)
        self.assertIn("1 MiB", self.run_covol("segment", "ball.nrrd", "-o", "c.vdb", "--config", "c.toml", code=2).stderr)


class Names(Stranger):
    def checked(self, *words, code=0, page=None):
        done = subprocess.run([COVOL, *map(str, words)], cwd=self.out, capture_output=True, timeout=300)
        printed = (done.stdout + done.stderr).decode()
        self.assertEqual(done.returncode, code, printed)
        self.assertIsNone(STEERS.search(printed), printed)
        if page:
            self.assertIsNone(STEERS.search((self.out / page).read_text().replace("\t", "")))
        return printed

    def test_structures(self):
        name = f"a{ESC}\n\u202eb/../x".replace("/", "_")
        write_xyz(self.out / "small.xyz", [tuple(c + (p - c) / 3 for p, c in zip(point, CENTER)) for point in sphere_points(600)])
        words = ["segment", "ball.nrrd", "--points", f"{name}=ball.xyz", "other=small.xyz", "--init", "tag", "--max-steps", "1", "-o", "s.vdb", "--mesh", "s.ply",
                 "--mask", "s.nii.gz", "--table", "s.csv", "--report", "s.html", "--usda", "s.usda", "--json", "r.json", "--evidence", "e.csv"]
        self.checked(*words, page="s.html")
        for file in self.files():
            self.assertIsNone(STEERS.search(file), file)
        for text in ("s.csv", "s.usda", "e.csv", *(name for name in self.files() if name.startswith("s_labels"))):
            self.assertIsNone(STEERS.search((self.out / text).read_text().replace("\t", "")), text)
        shown = json.loads((self.out / "r.json").read_text())["structures"][0]["name"]
        self.assertEqual(shown, "a\\u001b]0;title\\u0007\\u001b[31m\\u000a\\u202eb_.._x")
        for file in self.files():
            if file.endswith((".vdb", ".ply", ".nii.gz")):
                self.checked("info", file)
                self.checked("check", file)

    def test_paths(self):
        for name in (f"x{ESC}", "y\x9b31m", "z\u202egpj", "w\x7f"):
            with self.subTest(name):
                os.makedirs(self.out / name)
                shutil.copy(self.image, self.out / name / f"{name}.nrrd")
                shutil.copy(self.points, self.out / name / f"{name}.xyz")
                place = f"{name}/{name}"
                self.checked("segment", f"{place}.nrrd", "--points", f"{place}.xyz", "--init", "tag", "--max-steps", "1", "-o", f"{place}.vdb", "--report", f"{place}.html",
                             page=f"{place}.html")
                self.checked("rerun", f"{place}.vdb")
                self.checked("info", f"{place}.vdb")
                self.checked("info", f"{place}.xyz")
                self.checked("info", f"{place}.nrrd", "--json", "-")
                self.checked("info", f"{place}.none", code=4)
                self.checked("segment", f"{place}.nrrd", "--points", f"{place}.xyz", "--theta", ESC, "-o", "a.vdb", code=2)
                self.checked("segment", f"--{name}", code=2)
                self.checked(name, code=2)

    def test_latin_1(self):
        name = os.fsencode(self.out) + b"/caf\xe9\x9b.nrrd"
        shutil.copy(self.image, name)
        self.checked("info", os.fsdecode(name))
        self.checked("info", os.fsdecode(name) + "x", code=4)

    def test_grids(self):
        grid = vdb.createLevelSetSphere(5.0)
        grid.name = f"g{ESC}\nfake: line"
        grid["covol_unit"] = ESC
        vdb.write(str(self.out / "g.vdb"), [grid])
        printed = self.checked("info", "g.vdb")
        self.assertEqual(len(printed.splitlines()), 1)
        self.checked("check", "g.vdb")
        self.checked("info", "g.vdb", "--json", "-")
        self.checked("report", "g.vdb", "-o", "g.html", page="g.html")
        self.checked("render", "g.vdb", "-o", "g.png")
        self.checked("mesh", "g.vdb", "-o", "g.ply")
        header = (self.out / "g.ply").read_bytes().split(b"end_header")[0].decode()
        self.assertIsNone(STEERS.search(header), header)
        self.checked("mesh", "g.vdb:none", "-o", "g.ply", code=3)

    def test_labels_of_files(self):
        self.checked("segment", "ball.nrrd", "--points", "a=ball.xyz", "--init", "tag", "--max-steps", "1", "-o", "s.vdb", "--mask", "s.seg.nrrd")
        data = (self.out / "s.seg.nrrd").read_bytes()
        self.assertIn(b"Name:=a\n", data)
        (self.out / "p.seg.nrrd").write_bytes(data.replace(b"Name:=a\n", f"Name:=../{ESC}\u202e\n".encode()))
        self.checked("segment", "ball.nrrd", "--painted", "p.seg.nrrd", "-o", "p.vdb", "--mesh", "p.ply", "--max-steps", "1")
        self.checked("info", "p.seg.nrrd")


if __name__ == "__main__":
    unittest.main()
