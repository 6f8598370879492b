"""covol rerun: results repeated from their own provenance, with the real binary.

    COVOL=build/bin/covol python3 -m unittest tests/cli/rerun_test.py
"""
import json
import re
import shutil
import subprocess
import unittest

import numpy as np
import pyopenvdb as vdb

from covol_case import COVOL, Case, sphere_points, write_xyz
from image_formats_case import ORIGIN, SPACING, write_dicom_series


class Rerun(Case):
    def make(self, *more):
        shutil.copy(self.image, self.out / "ball.nrrd")
        shutil.copy(self.points, self.out / "marks with space.xyz")
        self.run_covol("segment", "ball.nrrd", "--points", "marks with space.xyz", "--init", "tag", "-o", "s.vdb", "--mesh", "s.ply", *more)

    def test_the_same_bits(self):
        self.make("--delta", "0.7vx", "--max-steps", "20", "--density", "s.vdb", "--up", "y", "--unit-scale", "0.5")
        before = self.files()
        done = self.run_covol("rerun", "s.vdb", "--threads", "2", "--quiet", "-o", "again.vdb", "--json", "r.json")
        self.assertIn("bit-identical", done.stdout)
        report = json.loads((self.out / "r.json").read_text())["rerun"]
        self.assertTrue(report["same"])
        self.assertEqual([grid["name"] for grid in report["grids"]], ["density", "surface"])
        self.assertEqual(self.files(), sorted(before + ["again.vdb", "r.json"]))

    def test_digests_are_those_of_xxh128sum(self):
        self.make()
        output = subprocess.run(["xxh128sum", "ball.nrrd", "marks with space.xyz"], cwd=self.out, capture_output=True, text=True, check=True)
        expected = [{"name": line[34:], "digest": f"xxh128:{line[:32]}"} for line in output.stdout.splitlines()]
        facts = vdb.readMetadata(str(self.out / "s.vdb"))
        self.assertEqual(json.loads(facts["covol_inputs"]), expected)

    def test_from_another_folder_by_another_name(self):
        self.make()
        away = self.out / "away"
        away.mkdir()
        (self.out / "s.vdb").rename(away / "renamed.vdb")
        elsewhere = self.out / "inputs"
        elsewhere.mkdir()
        for name in ("ball.nrrd", "marks with space.xyz"):
            (self.out / name).rename(elsewhere / name)
        self.assertIn("ball.nrrd: an input of that run is not in", self.run_covol("rerun", "away/renamed.vdb", code=4).stderr)
        self.assertIn("bit-identical", self.run_covol("rerun", "away/renamed.vdb", "--inputs", elsewhere).stdout)

    def test_inputs_that_changed_and_results_that_did(self):
        self.make()
        marks = self.out / "marks with space.xyz"
        text = marks.read_text()
        marks.write_text(text + "\n")
        self.assertIn("not the file that the run read: expected xxh128:", self.run_covol("rerun", "s.vdb", code=3).stderr)
        marks.write_text(text)
        grid, facts = vdb.readAll(str(self.out / "s.vdb"))
        at = next(item.min for item in grid[0].citerOnValues())
        grid[0].getAccessor().setValueOn(at, grid[0].getConstAccessor().getValue(at) + 1e-3)
        vdb.write(str(self.out / "s.vdb"), grid, facts)
        done = self.run_covol("rerun", "s.vdb", code=3)
        self.assertRegex(done.stdout, r"surface: 1 voxels differ, by up to \S+")
        self.assertAlmostEqual(float(re.search(r"by up to (\S+)", done.stdout)[1]), 1e-3, delta=1e-6)

    def test_a_dicom_series_that_changed(self):
        """The digest of a folder covers the files of the series, but no results in the same folder."""
        data = (40 + 60 * (np.hypot(*np.mgrid[-10:10, -12:12]) < 7))[None].repeat(10, axis=0)
        series = write_dicom_series(self.out / "series", data)
        (self.out / "marks.csv").write_text("x,y,z,kind\n" + "".join(
            f"{ORIGIN[0] + SPACING[0] * (12 + 7 * c)},{ORIGIN[1] + SPACING[1] * (10 + 7 * s)},{ORIGIN[2] + SPACING[2] * k},surface\n"
            for k in (2, 4, 6) for c, s in ((1, 0), (0, 1), (-1, 0), (0, -1), (0.7, 0.7), (-0.7, -0.7))))
        self.run_covol("segment", "series", "--points", "marks.csv", "-o", "series/s.vdb", "--max-steps", 3,
                       "--mask", "series/mask.dcm", "--rtstruct", "series/contours.dcm")
        shutil.copy(self.out / "series/s.vdb", self.out / "s.vdb")
        self.assertIn("bit-identical", self.run_covol("rerun", "s.vdb").stdout)
        one = sorted(series.glob("1.2*.dcm"))[4]
        content = bytearray(one.read_bytes())
        content[-1000] ^= 1
        one.write_bytes(content)
        self.assertIn("not the file that the run read: expected xxh128-of-files:", self.run_covol("rerun", "s.vdb", code=3).stderr)

    def test_points_alone_and_a_label_image(self):
        write_xyz(self.out / "p.xyz", sphere_points(6000))
        self.run_covol("reconstruct", "p.xyz", "-o", "r.vdb")
        self.assertIn("bit-identical", self.run_covol("rerun", "r.vdb").stdout)
        self.run_covol("phantom", "torus", "--size", "40", "-o", "t.nrrd", "--points", "t.xyz")
        self.run_covol("segment", "t.nrrd", "--points", "a=t.xyz", "--init", "sphere:0,0,0,1", "-o", "t.vdb", "--max-steps", "4")
        self.assertIn("bit-identical", self.run_covol("rerun", "t.vdb").stdout)

    def write_with(self, name, changed):
        """Writes s.vdb with other metadata."""
        grids, facts = vdb.readAll(str(self.out / "s.vdb"))
        for grid in grids:
            for key, value in changed.items():
                grid[key] = value
        vdb.write(str(self.out / name), grids, facts | changed)

    def test_metadata_of_a_stranger(self):
        self.make()
        facts = vdb.readMetadata(str(self.out / "s.vdb"))
        options = json.loads(facts["covol_options"])
        for name, value, expected_text in (("covol_given", '"output"', "damaged"), ("covol_given", '[3]', "damaged"),
                                  ("covol_given", '["frames"]', "missing"), ("covol_given", "nothing", "damaged"),
                                  ("covol_inputs", '[{"name": 1}]', "damaged"), ("covol_inputs", "[4]", "damaged"),
                                  ("covol_inputs", '[{"name": "../ball.nrrd", "digest": "xxh128:"}]', "expected a file's name"),
                                  ("covol_options", "[]", "damaged"), ("covol_options", json.dumps(options | {"output": []}), "damaged"),
                                  ("covol_options", json.dumps(options | {"output": {"a": 1}}), "damaged"),
                                  ("covol_options", json.dumps(options | {"command": "rerun"}), "rerun the original result"),
                                  ("covol_options", json.dumps(options | {"command": "fly"}), "no command 'fly'")):
            with self.subTest(name=name, value=value[:40]):
                self.write_with("t.vdb", {name: value})
                self.assertIn(expected_text, self.run_covol("rerun", "t.vdb", code=3).stderr)
        # The output path in the metadata leads out of the folder. The run ignores it and writes only the file of -o.
        self.write_with("t.vdb", {"covol_options": json.dumps(options | {"output": "../../away.vdb"})})
        before = self.files()
        self.assertIn("bit-identical", self.run_covol("rerun", "t.vdb", "-o", "again.vdb").stdout)
        self.assertEqual(self.files(), sorted(before + ["again.vdb"]))

    def test_a_signal_ends_the_run_within(self):
        self.make()
        facts = vdb.readMetadata(str(self.out / "s.vdb"))
        options = json.loads(facts["covol_options"]) | {"max-steps": 10**8, "tolerance": 0}
        given = json.loads(facts["covol_given"]) + ["max-steps", "tolerance"]
        self.write_with("t.vdb", {"covol_options": json.dumps(options), "covol_given": json.dumps(given)})
        run = subprocess.Popen([COVOL, "rerun", "t.vdb", "-o", "again.vdb"], cwd=self.out, stderr=subprocess.PIPE, text=True)
        try:
            while "running" not in run.stderr.readline():
                self.assertIsNone(run.poll(), "ended before the signal")
            run.terminate()
            run.communicate(timeout=60)  # waits for the inner run, too: it has the same stderr
        finally:
            run.kill()
        self.assertEqual(run.returncode, 130)
        self.assertNotIn("again.vdb", self.files())

    def test_what_cannot_be_repeated(self):
        self.run_covol("convert", self.image, "i.vdb")
        self.assertIn("ball.nrrd", self.run_covol("rerun", "i.vdb", code=4).stderr)
        vdb.write(str(self.out / "foreign.vdb"), vdb.createLevelSetSphere(5.0))
        self.assertIn("another program or an older covol wrote it", self.run_covol("rerun", "foreign.vdb", code=3).stderr)
        (self.out / "piped.xyz").write_text(self.points.read_text())
        subprocess.run(f"cat piped.xyz | {COVOL} reconstruct - -o p.vdb --quiet", shell=True, cwd=self.out, check=True)
        self.assertIn("through a pipe", self.run_covol("rerun", "p.vdb", code=3).stderr)


if __name__ == "__main__":
    unittest.main()
