"""The predictions of covol plan, compared with the actual job.

    COVOL=build/bin/covol python3 -m unittest tests/cli/plan_test.py
"""
import json
import unittest

from covol_case import Case


class Plan(Case):
    def run_both(self, *job):
        """The plan, and the report of the actual job."""
        self.run_covol("plan", *job, "--json", "plan.json")
        self.assertEqual([path.name for path in self.out.iterdir()], ["plan.json"])
        planned = json.loads((self.out / "plan.json").read_text())["plan"]
        self.run_covol(*job, "--json", "job.json")
        return planned, json.loads((self.out / "job.json").read_text())

    def check(self, planned, report):
        self.assertLess(abs(planned["active_voxels"] / report["grid"]["active_voxels"] - 1), 0.4)
        self.assertGreater(planned["memory_bytes"], 0.7 * report["peak_rss_bytes"])
        self.assertLess(planned["memory_bytes"], 1.5 * report["peak_rss_bytes"])
        self.assertGreater(planned["seconds"], 0)

    def test_cloud(self):
        self.run_covol("phantom", "torus", "--size", "16", "--count", "8000", "-o", self.inputs / "i.nrrd", "--points",
                       self.inputs / "p.xyz")
        self.check(*self.run_both("reconstruct", self.inputs / "p.xyz", "--voxel-size", "0.01", "-o", "s.vdb"))

    def test_image_and_marks(self):
        self.run_covol("phantom", "torus", "--size", "100", "--count", "300", "-o", self.inputs / "t.nrrd", "--points",
                       self.inputs / "t.xyz")
        planned, report = self.run_both("segment", self.inputs / "t.nrrd", "--points", self.inputs / "t.xyz", "-o", "s.vdb")
        self.check(planned, report)
        self.assertEqual(planned["image"]["size"], [100, 100, 100])
        self.assertEqual(planned["image"]["unpacked_bytes"], 100 ** 3)

    def test_structures_in_a_column(self):
        self.run_covol("phantom", "two-spheres", "--size", "40", "--count", "200", "-o", self.inputs / "i.nrrd", "--points", self.inputs / "p.xyz")
        rows = [line.split()[:3] for line in (self.inputs / "p.xyz").read_text().splitlines() if line[0] in "-0123456789"]
        names = ["left" if float(row[0]) < 0 else "right" for row in rows]
        table = self.inputs / "both.csv"
        table.write_text("x,y,z,cell\n" + "".join(",".join([*row, name]) + "\n" for row, name in zip(rows, names)))
        files = []
        for name in ("left", "right"):
            path = self.inputs / f"{name}.xyz"
            path.write_text("".join(" ".join(row) + "\n" for row, own in zip(rows, names) if own == name))
            files += ["--points", f"{name}={path}"]
        voxels = []
        for marks in (["--points", table, "--structure-column", "cell"], files):
            self.run_covol("plan", "segment", self.inputs / "i.nrrd", *marks, "-o", "s.vdb", "--json", "plan.json")
            voxels.append(json.loads((self.out / "plan.json").read_text())["plan"]["active_voxels"])
        self.assertGreater(voxels[0], 0)
        self.assertEqual(*voxels)

    def test_what_cannot_be_planned(self):
        self.assertIn("segment or reconstruct", self.run_covol("plan", "evolve", code=2).stderr)
        self.run_covol("phantom", "sphere", "--size", "32", "-o", self.inputs / "s.nrrd", "--points", self.inputs / "s.xyz")
        error = self.run_covol("plan", "segment", self.inputs / "s.nrrd", "--init", "sphere:0,0,0,0.3", "-o", "s.vdb", code=3).stderr
        self.assertIn("expected points or contours", error)


if __name__ == "__main__":
    unittest.main()
