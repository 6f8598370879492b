"""Marks as users have them: the real program reads them and reports what does not fit.

    COVOL=build/bin/covol python3 -m unittest tests/cli/points_test.py
    COVOL_DATA=FOLDER ... with the embryo phantom in FOLDER/phantoms, and a spleen in FOLDER/images
"""
import csv
import json
import math
import os
import pathlib
import struct
import unittest
import zipfile

import nibabel
import numpy as np

from covol_case import Case

# Sizes, spacings and coordinates of the origin differ between the axes, so that exchanged axes change the results.
SIZES = (60, 50, 16)
SPACING = (0.5, 0.4, 2.0)
ORIGIN = (12.0, 31.0, 207.0)


def index_marks():
    """Closed outlines on every second slice, in voxels."""
    return [(30.3 + 18.2 * math.cos(0.2618 * n), 24.1 + 15.3 * math.sin(0.2618 * n) + 0.2 * k, k)
            for k in range(3, 14, 2) for n in range(24)]


def to_world(marks):
    return [tuple(o + s * v for o, s, v in zip(ORIGIN, SPACING, p)) for p in marks]


def roi(points, position):
    """A Fiji polygon with sub-pixel resolution: in coordinates of pixel corners, slices from 1."""
    n = len(points)
    head = bytearray(64)
    struct.pack_into(">4shB", head, 0, b"Iout", 228, 0)
    struct.pack_into(">H", head, 16, n)
    struct.pack_into(">h", head, 50, 128)
    struct.pack_into(">ii", head, 56, position, 64 + 12 * n)
    x, y = [p[0] + 0.5 for p in points], [p[1] + 0.5 for p in points]
    ints = struct.pack(f">{2 * n}h", *[int(v) for v in x + y])
    return bytes(head) + ints + struct.pack(f">{2 * n}f", *x, *y) + bytes(64)


class PointsCase(Case):
    """Image, and marks in world units and voxels."""

    def setUp(self):
        super().setUp()
        self.image3 = self.inputs / "box.nrrd"
        if not self.image3.exists():
            write_box(self.image3)
        self.marks = index_marks()
        self.world = to_world(self.marks)

    def write(self, name, rows, header="", separator=" "):
        path = self.inputs / name
        path.write_text(header + "".join(separator.join(f"{v:.9g}" for v in row) + "\n" for row in rows))
        return path

    def converted(self, path, *more):
        """The positions of the points in the image's world, as covol computes them."""
        out = self.out / "out.csv"
        self.run_covol("convert", path, out, "--like", self.image3, "--quiet", *more)
        with open(out) as file:
            return [tuple(map(float, row)) for row in csv.reader(file) if row[0][0] not in "#x"]

    def mistake(self, path, *expected_text, image=None, more=()):
        """Checks for an error that names the mistake and the option."""
        out = self.out / "s.vdb"
        line = self.refuse("segment", image or self.image3, "--points", path, "-o", out, *more, code=3, expected_text=expected_text[0])
        for part in expected_text[1:]:
            self.assertIn(part, line)

    def warning(self, path, *expected_text, image=None, more=()):
        done = self.run_covol("check", path, "--image", image or self.image3, *more)
        for part in expected_text:
            self.assertIn(part, done.stderr)


def write_box(path):
    head = ["NRRD0004", "type: uint8", "dimension: 3", "space: left-posterior-superior",
            "sizes: " + " ".join(map(str, SIZES)),
            "space directions: " + " ".join("(" + ",".join(str(SPACING[a] if a == b else 0) for b in range(3)) + ")"
                                            for a in range(3)),
            "endian: little", "encoding: raw", "space origin: (" + ",".join(map(str, ORIGIN)) + ")", "", ""]
    path.write_bytes("\n".join(head).encode() + bytes(SIZES[0] * SIZES[1] * SIZES[2]))


class Formats(PointsCase):
    def same_place(self, path, *more):
        got = self.converted(path, *more)
        self.assertEqual(len(got), len(self.world))
        # Sorted, because the polygons of a ZIP archive are read in the order of the archive.
        for a, b in zip(sorted(got), sorted(self.world)):
            for u, v in zip(a, b):
                self.assertAlmostEqual(u, v, delta=1e-4)

    def test_fiji_roi_manager(self):
        path = self.inputs / "RoiSet.zip"
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            for k in sorted({p[2] for p in self.marks}):
                archive.writestr(f"{k + 1:04}-0024-0030.roi", roi([p for p in self.marks if p[2] == k], k + 1))
        self.same_place(path)
        report = self.report("info", path)["points"]
        self.assertEqual(report["lines"], {"count": 6, "closed": 6})
        self.assertEqual(report["space"], "index")
        self.assertIn("6 polygon", report["rule"])

    def test_fiji_cell_counter(self):
        markers = "".join(f"<Marker><MarkerX>{x:.9g}</MarkerX><MarkerY>{y:.9g}</MarkerY><MarkerZ>{z + 1}</MarkerZ></Marker>"
                          for x, y, z in self.marks)
        path = self.inputs / "cells.xml"
        path.write_text("<?xml version='1.0'?><CellCounter_Marker_File><Image_Properties><Image_Filename>a.tif</Image_Filename>"
                        f"</Image_Properties><Marker_Data><Marker_Type><Type>1</Type>{markers}</Marker_Type></Marker_Data>"
                        "</CellCounter_Marker_File>")
        self.same_place(path)
        self.assertIn("Cell Counter (1 type), slices from 1", self.run_covol("info", path).stdout)

    def test_fiji_results(self):
        # Fiji writes x and y in the unit of the image, but without its origin.
        rows = [(n + 1, 200, p[0] * SPACING[0], p[1] * SPACING[1], p[2] + 1) for n, p in enumerate(self.marks)]
        path = self.write("Results.csv", rows, " ,Mean,X,Y,Slice\n", ",")
        self.same_place(path)
        self.assertIn("taken in the image's unit, not in pixels", self.run_covol("info", path).stdout)

    def test_napari(self):
        self.same_place(self.write("napari.csv", [(n, p[2], p[1], p[0]) for n, p in enumerate(self.marks)],
                                   "index,axis-0,axis-1,axis-2\n", ","))

    def test_slicer(self):
        points = [{"position": [-p[0], -p[1], p[2]], "positionStatus": "defined"} for p in self.world]
        path = self.inputs / "marks.mrk.json"
        path.write_text(json.dumps({"markups": [{"type": "Fiducial", "coordinateSystem": "RAS", "controlPoints": points}]}))
        self.same_place(path)
        self.assertIn("RAS turned to LPS", self.run_covol("info", path).stdout)

    def test_options_go_before_the_format(self):
        path = self.write("reversed.xyz", [(p[2], p[1], p[0]) for p in self.marks])
        self.refuse("info", path, "--points-space", "moon", code=2, expected_text="--points-space")
        self.same_place(path, "--points-space", "index", "--points-order", "zyx")
        self.same_place(self.write("ras.xyz", [(-p[0], -p[1], p[2]) for p in self.world]), "--points-space", "ras")
        self.same_place(self.write("nm.xyz", [tuple(1000 * v for v in p) for p in self.world]), "--points-scale", "0.001")


class Mistakes(PointsCase):
    def test_swapped_axes(self):
        self.mistake(self.write("swapped.xyz", [p[::-1] for p in self.world]), "--points-order zyx would bring them inside",
                     "the order of the axes is reversed")

    def test_pixels_given_as_world(self):
        self.mistake(self.write("pixels.xyz", self.marks), "--points-space index would bring them inside",
                     "they are voxels, not world units")
        self.mistake(self.write("zyx.xyz", [p[::-1] for p in self.marks]), "--points-space index --points-order zyx would")

    def test_ras_for_lps(self):
        self.mistake(self.write("ras.xyz", [(-p[0], -p[1], p[2]) for p in self.world]),
                     "--points-space ras would bring them inside", "they are in RAS, the image is in LPS")

    def test_another_unit(self):
        self.mistake(self.write("nm.xyz", [tuple(1000 * v for v in p) for p in self.world]), "--points-scale 0.001 would")

    def test_origin_left_out(self):
        self.mistake(self.write("local.xyz", [tuple(v - o for v, o in zip(p, ORIGIN)) for p in self.world]),
                     "--points-space local would", "they leave out the image's origin")

    def test_both_boxes_are_reported(self):
        path = self.write("far.xyz", [(1e4, -1e4, 0), (2e4, 5, 6)])
        self.mistake(path, "2 of 2 points lie outside the image: points from (10000, -10000, 0) to (20000, 5, 6), image from ")

    def test_no_remark_on_what_is_right(self):
        done = self.run_covol("check", self.write("right.xyz", self.world), "--image", self.image3)
        self.assertNotIn("--points", done.stderr)


class Embryo(PointsCase):
    """The embryo phantom: a Fiji stack of 0.35 x 0.35 x 1 um, its contours in pixels and slices."""

    def setUp(self):
        super().setUp()
        folder = os.environ.get("COVOL_DATA")
        self.stack = pathlib.Path(folder or "") / "phantoms" / "embryo.tif"
        if not folder or not self.stack.exists():
            self.skipTest("SKIPPED: COVOL_DATA names no folder with phantoms/embryo.tif")
        with open(self.stack.with_name("embryo_ve_contours.csv")) as file:
            self.pixels = [(float(r["x_px"]), float(r["y_px"]), float(r["slice"])) for r in csv.DictReader(file)]
        self.um = [(0.35 * x, 0.35 * y, z) for x, y, z in self.pixels]

    def test_contours_are_right_as_they_are(self):
        path = self.stack.with_name("embryo_ve_contours.csv")
        done = self.run_covol("check", path, "--image", self.stack)
        self.assertNotIn("--points", done.stderr + done.stdout)
        report = self.report("info", path)["points"]
        self.assertEqual(report["count"], len(self.pixels))
        self.assertEqual(report["lines"]["closed"], report["lines"]["count"])

    def test_swapped_axes(self):
        self.mistake(self.write("swapped.xyz", [p[::-1] for p in self.um]), "--points-order zyx would", image=self.stack)

    def test_pixels_given_as_world(self):
        self.mistake(self.write("pixels.xyz", self.pixels), "--points-space index would", image=self.stack)

    def test_ras_for_lps(self):
        self.mistake(self.write("ras.xyz", [(-x, -y, z) for x, y, z in self.um]), "--points-space ras would", image=self.stack)

    def test_missing_spacing(self):
        try:
            import tifffile
        except ImportError:
            self.skipTest("SKIPPED: there is no tifffile")
        bare = self.out / "bare.tif"
        tifffile.imwrite(bare, tifffile.imread(self.stack), photometric="minisblack")
        self.warning(self.write("um.xyz", self.um), "the image states no spacing", "--spacing sx,sy,sz", image=bare)


class Cleaning(PointsCase):
    def setUp(self):
        super().setUp()
        lines = self.points.read_text().splitlines()
        self.dirty = self.inputs / "dirty.xyz"
        self.dirty.write_text("\n".join(lines + lines[:50] + [f"{90 + 7 * n} {80 - 11 * n} {n}" for n in range(5)]) + "\n")

    def test_convert_cleans_and_reports(self):
        report = self.report("convert", self.dirty, "clean.xyz", "--remove-outliers")["points"]["cleanup"]
        self.assertEqual((report["given"], report["duplicates"], report["outliers"], report["kept"]), (1555, 50, 5, 1500))
        kept = [line for line in (self.out / "clean.xyz").read_text().splitlines() if line[0] != "#"]
        for a, b in zip(kept, self.points.read_text().splitlines()):
            self.assertEqual([float(v) for v in a.split()], [float(v) for v in b.split()])
        self.assertEqual(len(kept), 1500)
        done = self.run_covol("convert", self.dirty, "clean.xyz", "--remove-outliers=4", "--simplify", 1, "--smooth", "jets")
        self.assertRegex(done.stderr, r"cloud: \d+ of 1555 points kept; 50 duplicates, 5 outliers in \d+ passes, \d+ by cells of 1; jets moved")

    def test_reconstruct_survives_far_points(self):
        report = self.report("reconstruct", self.dirty, "-o", "s.vdb", "--remove-outliers", "--voxel-size", 0.5, "--simplify", "1vx")
        cleanup = report["input"]["points"]["cleanup"]
        self.assertEqual(cleanup["outliers"], 5)
        self.assertGreater(cleanup["simplified"], 0)
        self.assertEqual(report["surface"]["components"], 1)
        clean = self.report("reconstruct", self.points, "-o", "c.vdb", "--voxel-size", 0.5)
        self.assertAlmostEqual(report["surface"]["volume"] / clean["surface"]["volume"], 1, delta=0.01)

    def test_bad_values(self):
        self.refuse("convert", self.dirty, "o.xyz", "--remove-outliers=0.5", code=3, expected_text="--remove-outliers: expected 0 or >= 1")
        self.refuse("convert", self.dirty, "o.xyz", "--remove-outliers=many", code=2, expected_text="--remove-outliers")
        self.refuse("convert", self.dirty, "o.xyz", "--smooth", "butter", code=2, expected_text="--smooth")
        self.refuse("convert", self.dirty, "o.xyz", "--simplify", "1vx", code=2, expected_text="--like IMAGE")


class WrongMarks(Case):
    @unittest.skipUnless(os.environ.get("COVOL_DATA"), "SKIPPED: COVOL_DATA is not set")
    def test_few_among_many_in_thick_slices(self):
        """A spleen in slices of 5 mm: correct marks are off by half a slice, which is no reason to reject the body."""
        folder = pathlib.Path(os.environ["COVOL_DATA"]) / "images"
        truth = np.asanyarray(nibabel.load(folder / "ct_spleen_gt.nii.gz").dataobj) > 0
        rng = np.random.default_rng(5)
        faces = []
        for axis in range(3):
            change = np.argwhere(np.diff(truth, axis=axis))
            faces.append(change + 0.5 * np.eye(3)[axis])
        marks = rng.permutation(np.concatenate(faces))[:300] + rng.uniform(-0.5, 0.5, (300, 3))
        inside = np.argwhere(truth)
        low, high = inside.min(0), inside.max(0)
        margin = 0.3 * (high - low)
        marks[:15] = np.clip(rng.uniform(low - margin, high + margin, (15, 3)), 0, np.array(truth.shape) - 1)
        path = self.inputs / "wrong.csv"
        path.write_text("x,y,z\n" + "\n".join(",".join(f"{v:.4f}" for v in mark) for mark in marks) + "\n")
        report = self.report("segment", folder / "ct_spleen.nii.gz", "--points", path, "--points-space", "index", "-o", "w.vdb",
                             "--mask", "w.nii.gz")
        self.assertGreater(len(report["inference"]["wrong_marks"]), 8)
        alike = self.report("compare", "w.nii.gz", folder / "ct_spleen_gt.nii.gz")["compare"]
        self.assertGreater(alike["dice"], 0.95)


if __name__ == "__main__":
    unittest.main()
