"""Several structures, and evidence, with the real binary.

    COVOL=build/bin/covol python3 -m unittest tests/cli/structures_test.py
"""
import json
import math
import pathlib
import re
import unittest

import numpy as np
import tifffile

from covol_case import Case, write_nrrd
from structures_case import DATA, ORIGIN, SIZE, H, ball_image, ball_points, lattice, nrrd_keys, rows_of, write_points


class Structures(Case):
    LEFT, RIGHT, RADIUS = (-3.0, 0.2, 0.0), (3.0, -0.1, 0.1), 4.5  # two balls that overlap by 3 units of length

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.scene = cls.inputs / "two.nrrd"
        both = np.maximum(ball_image(cls.LEFT, cls.RADIUS), ball_image(cls.RIGHT, cls.RADIUS))
        write_nrrd(cls.scene, (SIZE,) * 3, both.tobytes(), spacing=H, origin=ORIGIN)
        cls.left, cls.right = cls.inputs / "left.xyz", cls.inputs / "right.xyz"
        cls.few_left, cls.few_right = cls.inputs / "few_left.xyz", cls.inputs / "few_right.xyz"
        for count, left, right in ((1500, cls.left, cls.right), (100, cls.few_left, cls.few_right)):
            write_points(left, ball_points(cls.LEFT, cls.RADIUS, count))
            write_points(right, ball_points(cls.RIGHT, cls.RADIUS, count))

    def two(self, *more, few=False):
        """@param few  with a hundred marks on each ball, which take less time, where a test is about the files"""
        left, right = (self.few_left, self.few_right) if few else (self.left, self.right)
        return ("segment", self.scene, "--points", f"left={left}", f"right={right}", "--rho", 0, "--delta", "0.2vx", "-o", "s.vdb",
                *more)

    def expected_volume(self):
        """A ball without the cap beyond the middle plane."""
        half = math.dist(self.LEFT, self.RIGHT) / 2
        t = self.RADIUS - half
        return 4 / 3 * math.pi * self.RADIUS ** 3 - math.pi * t * t * (3 * self.RADIUS - t) / 3

    def test_from_files_to_files(self):
        report = self.report(*self.two("--mask", "m.seg.nrrd", "--mesh", "m.ply", "--table", "t.csv", "--density", "d.vdb"))
        self.assertEqual(self.files(), ["d.vdb", "m.seg.nrrd", "m_left.ply", "m_right.ply", "s.vdb", "t.csv"])
        self.assertEqual([g["name"] for g in self.report("info", "s.vdb")["grids"]], ["left", "right"])
        self.assertEqual([g["name"] for g in self.report("info", "d.vdb")["grids"]], ["density_left", "density_right"])
        structures = report["structures"]
        self.assertEqual([s["name"] for s in structures], ["left", "right"])
        self.assertEqual([s["label"] for s in structures], [1, 2])
        for s, name in zip(structures, ("left", "right")):
            self.assertEqual(s["input"]["points"]["count"], 1500)
            self.assertEqual(s["vdb_grid"], name)
            self.assertEqual(s["solve"]["stop_reason"], "steady")
            self.assertTrue(s["surface"]["closed"])
            self.assertEqual((s["surface"]["components"], s["surface"]["genus"]), (1, 0))
            # The steady surface is 0.1 voxel inside the points, at a radius of 9 voxels: 3 % of the volume.
            self.assertLess(abs(s["surface"]["volume"] / self.expected_volume() - 1), 0.045)
            for field in ("resolved", "automatic", "grid", "fit", "guess"):
                self.assertIn(field, s)
            # Each ball has lost a cap of height 1.5 to the other structure: its marks on that cap lie outside of it.
            self.assertGreater(s["fit"]["points_to_surface"]["bias"], 0.08)
            self.assertGreater(s["fit"]["marks_off"]["count"], 20)
            self.assertAlmostEqual(s["fit"]["marks_off"]["farthest"]["distance"], 1.5, delta=0.2)
        overlap, = report["overlaps"]
        self.assertEqual(overlap["structures"], ["left", "right"])
        self.assertNotIn("inner", overlap)
        rows = rows_of(self.out / "t.csv")
        self.assertEqual([r["structure"] for r in rows], ["left", "right"])
        for row, s in zip(rows, structures):
            self.assertAlmostEqual(float(row["volume"]), s["surface"]["volume"], places=3)
            self.assertAlmostEqual(float(row["area"]), s["surface"]["area"], places=3)
            self.assertTrue(0.8 < float(row["sphericity"]) < 1)
            # Along x the extent ends at the plane halfway between the balls.
            self.assertAlmostEqual(float(row["extent_y"]), 2 * self.RADIUS, delta=0.3)
            self.assertAlmostEqual(float(row["extent_x"]), self.RADIUS + math.dist(self.LEFT, self.RIGHT) / 2, delta=0.3)
            self.assertEqual(float(row["centroid_x"]) > 0, s["name"] == "right")
            self.assertEqual(row["genus"], "0")

    def test_finer_voxels_come_closer(self):
        for s in self.report(*self.two("--voxel-size", H / 2))["structures"]:
            self.assertLess(abs(s["surface"]["volume"] / self.expected_volume() - 1), 0.02)

    def test_labels_meet_without_overlap_or_slit(self):
        self.run_covol(*self.two("--mask", "m.tif", few=True))
        self.assertEqual(self.files(), ["m.tif", "m_labels.txt", "s.vdb"])
        labels = tifffile.imread(self.out / "m.tif")
        self.assertEqual(sorted(np.unique(labels)), [0, 1, 2])
        x, y, z = lattice()
        a = np.sqrt(sum((c - m) ** 2 for c, m in zip((x, y, z), self.LEFT))) - self.RADIUS
        b = np.sqrt(sum((c - m) ** 2 for c, m in zip((x, y, z), self.RIGHT))) - self.RADIUS
        # Tested are voxels more than one voxel from the surfaces and the border between the balls.
        self.assertTrue(np.all(labels[(a < -H) & (a < b - 2 * H)] == 1))
        self.assertTrue(np.all(labels[(b < -H) & (b < a - 2 * H)] == 2))
        self.assertTrue(np.all(labels[np.minimum(a, b) < -H] != 0))
        self.assertTrue(np.all(labels[np.minimum(a, b) > H] == 0))
        text = (self.out / "m_labels.txt").read_text()
        self.assertRegex(text, r'(?m)^ +1 +\d+ +\d+ +\d+ +1 +1 +1 +"left"$')
        self.assertRegex(text, r'(?m)^ +2 +\d+ +\d+ +\d+ +1 +1 +1 +"right"$')

    def test_names_beside_masks_of_long_endings(self):
        for mask, labels in (("m.nii.gz", "m_labels.txt"), ("M.OME.TIF", "M_labels.txt"), ("a.b.mha", "a.b_labels.txt")):
            self.run_covol(*self.two("--mask", mask, "--max-steps", 1, few=True))
            self.assertIn("left", (self.out / labels).read_text())
            self.assertEqual(self.files(), sorted([mask, labels, "s.vdb"]))
            for name in self.files():
                (self.out / name).unlink()

    def test_segmentation_for_slicer(self):
        self.run_covol(*self.two("--mask", "m.seg.nrrd", few=True))
        keys = nrrd_keys(self.out / "m.seg.nrrd")
        self.assertEqual((keys["Segment0_Name"], keys["Segment1_Name"]), ("left", "right"))
        self.assertEqual((keys["Segment0_LabelValue"], keys["Segment1_LabelValue"]), ("1", "2"))
        self.assertNotEqual(keys["Segment0_Color"], keys["Segment1_Color"])
        extent = list(map(int, keys["Segment0_Extent"].split()))
        for axis in range(3):
            low = (self.LEFT[axis] - self.RADIUS - ORIGIN[axis]) / H
            self.assertLess(abs(extent[2 * axis] - low), 1.6)
        self.assertEqual(keys["Segmentation_MasterRepresentation"], "Binary labelmap")

    def test_one_mesh_file_with_two_objects(self):
        self.run_covol(*self.two("--mesh", "m.obj", few=True))
        self.assertEqual(self.files(), ["m.obj", "s.vdb"])
        text = (self.out / "m.obj").read_text()
        self.assertEqual(re.findall(r"(?m)^o (.*)$", text), ["left", "right"])
        self.assertEqual(self.report("info", "m.obj")["command"], "info")
        self.run_covol(*self.two("--mesh", "m.glb", few=True))
        data = (self.out / "m.glb").read_bytes()
        header = json.loads(data[20:20 + int.from_bytes(data[12:16], "little")])
        self.assertEqual([n["name"] for n in header["nodes"]], ["left", "right"])

    def test_order_and_threads_do_not_matter(self):
        first = self.report(*self.two("--threads", 1))["structures"]
        turned = self.report("segment", self.scene, "--points", f"right={self.right}", f"left={self.left}", "--rho", 0,
                             "--delta", "0.2vx", "-o", "t.vdb", "--threads", 2)["structures"]
        self.assertEqual([s["name"] for s in turned], ["right", "left"])
        self.assertEqual(first[0]["surface"], turned[1]["surface"])
        self.assertEqual(first[1]["surface"], turned[0]["surface"])

    def test_nested_with_a_seed_of_one_structure(self):
        # The structures are a shell with a cavity, and a ball, `core`, that fills the cavity.
        points = np.concatenate([ball_points((0, 0, 0), 9, 4000), ball_points((0, 0, 0), 5)])
        shell, core = self.inputs / "shell.xyz", self.inputs / "core.xyz"
        write_points(shell, points)
        write_points(core, ball_points((0, 0, 0), 5))
        marks = ("--points", f"shell={shell}", f"core={core}", "--rho", 0, "-o", "s.vdb")
        report = self.report("segment", self.scene, *marks, "--exterior-seed", "shell:0,0,0")
        by_name = {s["name"]: s["surface"]["volume"] for s in report["structures"]}
        whole = 4 / 3 * math.pi
        self.assertLess(abs(by_name["core"] / (whole * 125) - 1), 0.05)
        self.assertLess(abs(by_name["shell"] / (whole * (729 - 125)) - 1), 0.05)
        # Without the seed and the marks on the cavity, the shell is a solid ball, from which the core is subtracted.
        report = self.report("segment", self.scene, "--points", f"shell={self.outer()}", f"core={core}", "--rho", 0, "-o", "t.vdb")
        self.assertEqual(report["overlaps"][0]["inner"], "core")
        again = {s["name"]: s["surface"]["volume"] for s in report["structures"]}
        self.assertLess(abs(again["shell"] / by_name["shell"] - 1), 0.02)
        (self.out / "s.vdb").unlink()
        (self.out / "t.vdb").unlink()
        self.refuse("segment", self.scene, *marks, "--exterior-seed", "shel:0,0,0", code=2, expected_text="shel")
        self.refuse("segment", self.scene, *marks, "--exterior-seed", "shell:0,0", code=2, expected_text="--exterior-seed")

    def outer(self):
        path = self.inputs / "outer.xyz"
        write_points(path, ball_points((0, 0, 0), 9, 4000))
        return path

    def test_names(self):
        self.refuse("segment", self.scene, "--points", f"left={self.left}", self.right, "-o", "s.vdb", code=2, expected_text="name")
        self.refuse("segment", self.scene, "--points", f"a={self.few_left}", f"b={self.few_left}", "--rho", 0, "-o", "s.vdb", code=3,
                    expected_text="same solid")
        self.refuse("segment", self.scene, "--points", "a=none.xyz", "-o", "s.vdb", code=4, expected_text="none.xyz")
        self.refuse("segment", self.scene, "--points", f"left={self.left}", f"right={self.right}", "--init", "sphere:0,0,0,5",
                    "-o", "s.vdb", code=2, expected_text="--init")
        # The name of an existing file contains "=": the whole word is then the file, not NAME=FILE.
        odd = self.inputs / "left=1.xyz"
        odd.write_bytes(self.few_left.read_bytes())
        report = self.report("segment", self.scene, "--points", odd, "-o", "s.vdb", "--rho", 0)
        self.assertNotIn("structures", report)
        self.assertEqual(report["input"]["points"]["count"], 100)
        done = self.run_covol("segment", self.scene, "--points", "left=1.xyz", "-o", self.out / "s.vdb", "--rho", 0, cwd=self.inputs)
        self.assertNotIn("left: ", done.stderr)

    def test_the_last_file_is_read_before_the_first_is_solved(self):
        line, broken = self.inputs / "line.xyz", self.inputs / "broken.xyz"
        write_points(line, [(0.137 * n, 0.11, 0.07) for n in range(30)])
        broken.write_text("1 2 3\n1 2 x\n")
        self.refuse("segment", self.scene, "--points", f"line={line}", f"right={self.right}", "-o", "s.vdb", code=3, expected_text="line: ")
        self.refuse("segment", self.scene, "--points", f"line={line}", f"right={broken}", "-o", "s.vdb", code=3, expected_text="broken.xyz")

    def test_one_named_structure(self):
        report = self.report("segment", self.scene, "--points", f"the left={self.few_left}", "-o", "s.vdb", "--rho", 0, "--mesh",
                             "m.ply", "--mask", "m.nrrd")
        self.assertEqual(report["structures"][0]["name"], "the left")
        self.assertEqual([g["name"] for g in self.report("info", "s.vdb")["grids"]], ["surface"])
        self.assertEqual(self.files(), ["m.nrrd", "m.ply", "s.vdb"])
        self.assertEqual(nrrd_keys(self.out / "m.nrrd")["Segment0_Name"], "the left")

    def test_start_from_the_run_before(self):
        before = self.report(*self.two())["structures"]
        after = self.report("segment", self.scene, "--points", f"left={self.left}", f"right={self.right}", "--rho", 0,
                            "--delta", "0.2vx", "-o", "t.vdb", "--init", "vdb:s.vdb")["structures"]
        for a, b in zip(before, after):
            self.assertLess(abs(a["surface"]["volume"] / b["surface"]["volume"] - 1), 0.03)

    @unittest.skipUnless(DATA, "SKIPPED: COVOL_DATA is not set")
    def test_embryo(self):
        folder = pathlib.Path(DATA) / "phantoms"
        self.run_covol("segment", folder / "embryo.tif", "--points", f"ve={folder}/embryo_ve_points.ply",
                       f"exe={folder}/embryo_exe_points.ply", "--exterior-seed", "ve:89.6,89.6,28.5", "--rho", 0,
                       "-o", "e.vdb", "--mask", "e.seg.nrrd")
        for label, lower_bound in ((1, 0.98), (2, 0.985)):
            alike = self.report("compare", "e.seg.nrrd", folder / "embryo_labels.tif", "--label", label, "--spacing",
                                "0.35,0.35,1")["compare"]
            self.assertGreaterEqual(alike["dice"], lower_bound)


class Evidence(Case):
    CENTER, RADIUS = (0.0, 0.0, 0.0), 7.0

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.scene = cls.inputs / "half.nrrd"
        image = ball_image(cls.CENTER, cls.RADIUS)
        x, _, z = lattice()
        image[z > 0] = 20  # the upper half of the ball is not visible
        write_nrrd(cls.scene, (SIZE,) * 3, image.tobytes(), spacing=H, origin=ORIGIN)
        points = ball_points(cls.CENTER, cls.RADIUS, 6000)
        cls.marks = cls.inputs / "lower.xyz"
        write_points(cls.marks, points[points[:, 2] < 0])

    def judge(self, *more):
        # --max-steps 0: the surface is the start, a sphere, and only the evidence is computed.
        return ("segment", self.scene, "--points", self.marks, "--init", "sphere:0,0,0,%g" % self.RADIUS, "--max-steps", 0,
                "-o", "s.vdb", *more)

    def test_what_rests_on_nothing_does_not_depend_on_the_voxel_size(self):
        points = ball_points(self.CENTER, self.RADIUS, 300)
        few = self.inputs / "few.xyz"
        write_points(few, np.concatenate([points[points[:, 2] < 0][::3], points[points[:, 2] >= 0][::40]]))
        found = []
        for voxel in (1, 2):
            report = self.report("segment", self.scene, "--points", few, "--voxel-size", f"{voxel * H}", "--suggest", 2, "-o", "s.vdb")
            found.append(report["evidence"])
            # The reach d of a mark: up to this distance from it, the surface is accurate to a fourth of the image's
            # voxel H. Its error there is 0.3 d^2 / (2 R), where R is the radius of the body.
            radius = 3 * report["surface"]["volume"] / report["surface"]["area"]
            self.assertAlmostEqual(found[-1]["reach"], math.sqrt(radius * H / 0.6), delta=0.01 * H)
        one, other = (e["unsupported_area"] / e["area"] for e in found)
        self.assertAlmostEqual(one, other, delta=0.03)

    def test_suggestions_lie_on_the_bare_half(self):
        done = self.run_covol(*self.judge("--suggest", 3, "--json", "r.json"))
        lines = [l for l in done.stdout.splitlines() if "marks would help in slice" in l]
        report = json.loads((self.out / "r.json").read_text())["evidence"]
        self.assertEqual(len(lines), len(report["suggestions"]))
        self.assertGreaterEqual(len(lines), 2)
        self.assertEqual(report["reach"], 6 * H)
        for s in report["suggestions"]:
            self.assertGreater(s["world"][2], 0)
            self.assertAlmostEqual(s["index"][2], s["slice"], places=2)
            self.assertLess(abs(math.dist(s["world"], self.CENTER) - self.RADIUS), 0.3 * H)
            for axis in range(3):
                self.assertAlmostEqual(s["world"][axis], ORIGIN[axis] + H * s["index"][axis], places=4)
        # The marks end at the equator. They support the sphere as far as a chord of length `reach` extends beyond it,
        # which is up to the latitude `angle`.
        angle = 2 * math.asin(report["reach"] / (2 * self.RADIUS))
        self.assertAlmostEqual(report["unsupported_area"] / report["area"], (1 - math.sin(angle)) / 2, delta=0.02)

    def test_table_and_attributes(self):
        report = self.report(*self.judge("--evidence", "e.csv", "--mesh", "m.ply"))
        rows = rows_of(self.out / "e.csv")
        self.assertEqual(len(rows), len(report["evidence"]["slices"]))
        for row in rows:
            z = ORIGIN[2] + H * int(row["slice"])
            self.assertEqual(row["structure"], "surface")
            if -6 < z < -1:
                self.assertEqual(float(row["unsupported_share"]), 0)
                self.assertLess(float(row["surface_to_marks_mean"]), H)
                self.assertGreater(float(row["edge_strength"]), 0.25)
                self.assertGreater(int(row["marks"]), 0)
            if 4 < z < 6:
                self.assertGreater(float(row["unsupported_share"]), 0.99)
        head = (self.out / "m.ply").read_bytes()[:4000]
        self.assertIn(b"property float distance_to_marks\nproperty float edge_strength\n", head)

    def test_wrong_numbers(self):
        self.refuse(*self.judge("--suggest", -1), code=3, expected_text="--suggest")
        self.refuse(*self.judge("--evidence", "e.txt"), code=3, expected_text="--evidence")


if __name__ == "__main__":
    unittest.main()
