"""Contours: ordered marks on slices, with the real binary.

    COVOL=build/bin/covol python3 -m unittest tests/cli/contours_test.py
    COVOL_DATA=FOLDER ... with the embryo phantom in FOLDER/phantoms
"""
import csv
import json
import math
import os
import pathlib
import unittest
import zipfile

import numpy as np
import tifffile

from covol_case import Case
from points_test import roi
from structures_case import rows_of

# Sizes, spacings and coordinates of the origin differ between the axes, so that exchanged axes change the results.
SIZES = (80, 70, 24)
SPACING = (0.5, 0.4, 1.5)
ORIGIN = (12.0, 31.0, 207.0)
CENTRE = (39.0, 36.0, 11.0)  # centre of the ellipsoid, in voxels
DATA = os.environ.get("COVOL_DATA")


def outline(radius, k, count=48, centre=CENTRE):
    """A circle of a world radius on slice k, in voxels."""
    turns = 2 * np.pi * np.arange(count) / count
    return [(centre[0] + radius * math.cos(t) / SPACING[0], centre[1] + radius * math.sin(t) / SPACING[1], k) for t in turns]


def radius_at(k, whole=11.0, half=12.0):
    """Radius of an ellipsoid of revolution, with semi-axis `half` along z, on slice k, in world units."""
    w = (k - CENTRE[2]) * SPACING[2] / half
    return whole * math.sqrt(max(0.0, 1 - w * w))


ELLIPSOID = 4 / 3 * math.pi * 11 * 11 * 12


def ellipsoid(step=1):
    """Closed outlines on every step-th slice that cuts the ellipsoid by more than a voxel."""
    return [outline(radius_at(k), k) for k in range(4, 19, step)]


def write_table(path, outlines):
    with open(path, "w", newline="") as file:
        table = csv.writer(file)
        table.writerow(["slice", "contour", "x_px", "y_px"])
        for n, marks in enumerate(outlines):
            for x, y, k in marks:
                table.writerow([k, n, f"{x:.5f}", f"{y:.5f}"])


def world_lattice():
    axes = [o + s * np.arange(n) for n, s, o in zip(SIZES, SPACING, ORIGIN)]
    z, y, x = np.meshgrid(axes[2], axes[1], axes[0], indexing="ij")
    return x, y, z


CENTRE_WORLD = tuple(o + s * c for o, s, c in zip(ORIGIN, SPACING, CENTRE))


def write_nrrd(path, values):
    head = ["NRRD0004", "type: uint8", "dimension: 3", "space: left-posterior-superior", "sizes: " + " ".join(map(str, SIZES)),
            "space directions: " + " ".join("(" + ",".join(str(SPACING[a] if a == b else 0) for b in range(3)) + ")" for a in range(3)),
            "endian: little", "encoding: raw", "space origin: (" + ",".join(map(str, ORIGIN)) + ")", "", ""]
    path.write_bytes("\n".join(head).encode() + values.astype(np.uint8).tobytes())


class ContoursCase(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        x, y, z = (a - c for a, c in zip(world_lattice(), CENTRE_WORLD))
        r = np.sqrt((x / 11) ** 2 + (y / 11) ** 2 + (z / 12) ** 2)
        cls.solid = cls.inputs / "solid.nrrd"
        write_nrrd(cls.solid, 30 + 180 * np.clip((1 - r) * 11 / 0.5 + 0.5, 0, 1))
        cls.shell = cls.inputs / "shell.nrrd"  # an image in which the border of the same ellipsoid is a bright membrane
        write_nrrd(cls.shell, 30 + 180 * np.exp(-0.5 * ((r - 1) * 11 / 0.6) ** 2))

    def table(self, name, outlines):
        path = self.inputs / name
        write_table(path, outlines)
        return path

    def volume(self, *args):
        report = self.report("segment", *args, "-o", "s.vdb")
        self.assertTrue(report["surface"]["closed"])
        return report["surface"]["volume"]


class Bodies(ContoursCase):
    def test_every_slice(self):
        report = self.report("segment", self.solid, "--contours", self.table("all.csv", ellipsoid()), "-o", "s.vdb", "--rho", 0,
                             "--mask", "m.nrrd")
        reported = report["input"]["contours"]
        self.assertEqual((reported["closed"], reported["open"], reported["slices"]), (15, 0, 15))
        self.assertAlmostEqual(reported["slice_distance"], SPACING[2])
        self.assertEqual(report["input"]["points"]["count"], 15 * 48)
        self.assertEqual(report["input"]["points"]["densified"], reported["along"] + reported["between"])
        self.assertTrue(report["automatic"]["start"].startswith("contours"))
        self.assertEqual((report["surface"]["components"], report["surface"]["genus"]), (1, 0))
        self.assertEqual(report["solve"]["stop_reason"], "steady")
        self.assertLess(abs(report["surface"]["volume"] / ELLIPSOID - 1), 0.02)
        self.assertLess(report["fit"]["points_to_surface"]["p95"], 0.4)

    def test_a_small_body_in_the_corner_is_not_inside_out(self):
        # Two outlines on slices k - 2 and k. The one on slice k is far larger, and k is close to the last slice of the
        # image.
        k, radius = SIZES[2] - 3, 4.0
        corner = (SIZES[0] - 1 - 0.7 * radius / SPACING[0], SIZES[1] - 1 - 0.7 * radius / SPACING[1])
        lines = [outline(r, at, centre=corner) for r, at in ((0.9, k - 2), (radius, k))]
        lines = [[(min(x, SIZES[0] - 0.5), min(y, SIZES[1] - 0.5), at) for x, y, at in line] for line in lines]
        report = self.report("segment", self.solid, "--contours", self.table("corner.csv", lines), "-o", "s.vdb", "--rho", 0)
        # Upper bound: the body spans at most five slices and widens by at most 45 degrees over two and a half slices.
        self.assertLess(report["surface"]["volume"], math.pi * (radius + 2.5 * SPACING[2]) ** 2 * 5 * SPACING[2])
        self.assertEqual(report["surface"]["components"], 1)

    def test_skipped_slices(self):
        for step in (2, 4, 7):
            with self.subTest(step=step):
                volume = self.volume(self.solid, "--contours", self.table(f"every_{step}.csv", ellipsoid(step)), "--rho", 0)
                # A step of 7 leaves outlines on three slices. Between them the radius is a cubic with slope 0 at the
                # equator; halfway to the next outline it is thus 8.9 units of length instead of 9.9.
                self.assertLess(abs(volume / ELLIPSOID - 1), 0.03 if step < 7 else 0.08)

    def test_the_image_helps_between_slices(self):
        # The body has a waist between slices 7 and 15, where there are no marks: the initial surface is 2.5 voxels too
        # wide, and only the image shows the waist.
        x, y, z = (a - c for a, c in zip(world_lattice(), CENTRE_WORLD))
        waist = 9 - 0.5 * np.cos(np.pi * z / 6)
        image = self.inputs / "hourglass.nrrd"
        write_nrrd(image, 30 + 180 * np.clip((waist - np.hypot(x, y)) / 0.5 + 0.5, 0, 1))
        height = [(k - CENTRE[2]) * SPACING[2] for k in range(SIZES[2])]
        truth = [9 - 0.5 * math.cos(math.pi * w / 6) for w in height]
        path = self.table("hourglass.csv", [outline(truth[k], k) for k in (3, 7, 15, 19)])
        errors = []
        for rho in (0, 1):
            self.run_covol("segment", image, "--contours", path, "-o", "s.vdb", "--mask", f"{rho}.tif", "--rho", rho)
            mask = tifffile.imread(self.out / f"{rho}.tif") > 0
            errors.append([math.sqrt(mask[k].sum() * SPACING[0] * SPACING[1] / math.pi) - truth[k] for k in range(9, 14)])
        self.assertGreater(np.mean(errors[0]), 0.5)
        self.assertLess(np.mean(np.abs(errors[1])), 0.6 * np.mean(np.abs(errors[0])))

    def test_a_hole(self):
        marks = [outline(radius_at(k), k) for k in range(4, 19)] + [outline(4, k, 24) for k in range(4, 19)]
        path = self.table("tube.csv", marks)
        self.run_covol("segment", self.solid, "--contours", path, "-o", "s.vdb", "--mask", "m.tif", "--rho", 0)
        mask = tifffile.imread(self.out / "m.tif") > 0
        for k in range(5, 18):
            area = mask[k].sum() * SPACING[0] * SPACING[1]
            self.assertAlmostEqual(area / (math.pi * (radius_at(k) ** 2 - 16)), 1, delta=0.05)
            self.assertFalse(mask[k, round(CENTRE[1]), round(CENTRE[0])])

    def test_the_spline(self):
        few = [outline(radius_at(k), k, 8) for k in range(4, 19)]
        path = self.table("few.csv", few)
        lines = self.volume(self.solid, "--contours", path, "--rho", 0, "--contour-curve", "lines")
        spline = self.volume(self.solid, "--contours", path, "--rho", 0)
        # Area of a regular octagon / area of its circumscribed circle.
        octagon = 8 * math.sin(math.pi / 4) / (2 * math.pi)
        self.assertAlmostEqual(lines / ELLIPSOID, octagon, delta=0.02)
        self.assertAlmostEqual(spline / ELLIPSOID, 1, delta=0.03)

    def test_other_planes(self):
        # The same body, outlined in planes across x instead of z.
        marks = []
        for i in range(20, 59, 2):
            w = (i - CENTRE[0]) * SPACING[0] / 11
            if abs(w) > 0.97:
                continue
            s = math.sqrt(1 - w * w)
            marks.append([(i, CENTRE[1] + 11 * s * math.cos(t) / SPACING[1], CENTRE[2] + 12 * s * math.sin(t) / SPACING[2])
                          for t in 2 * np.pi * np.arange(40) / 40])
        path = self.inputs / "side.csv"
        with open(path, "w") as file:  # columns axis-0 to axis-2 of napari are z, y, x
            file.write("index,shape-type,vertex-index,axis-0,axis-1,axis-2\n")
            for n, line in enumerate(marks):
                for v, (x, y, z) in enumerate(line):
                    file.write(f"{n},polygon,{v},{z:.5f},{y:.5f},{x:.5f}\n")
        done = self.run_covol("segment", self.solid, "--contours", path, "-o", "s.vdb", "--rho", 0, "--json", "r.json")
        self.assertIn("slices across x", done.stderr)
        volume = json.loads((self.out / "r.json").read_text())["surface"]["volume"]
        self.assertLess(abs(volume / ELLIPSOID - 1), 0.03)

    def test_a_single_slice_requires_for_a_thickness(self):
        one = self.table("one.csv", [outline(11, 11)])
        self.refuse("segment", self.solid, "--contours", one, "-o", "s.vdb", "--rho", 0, code=3, expected_text="mark a second slice")
        height = 9.0
        volume = self.volume(self.solid, "--contours", one, "--rho", 0, "--contour-thickness", height)
        # Two paraboloids, each half of a cylinder.
        self.assertLess(abs(volume / (math.pi * 121 * height / 2) - 1), 0.05)

    def test_points_move_the_body(self):
        # The outlines cover slices 6 to 16. The domes beyond them end three voxels too far; the marks at the poles
        # correct this.
        path = self.table("middle.csv", [outline(radius_at(k), k) for k in (6, 11, 16)])
        poles = self.inputs / "poles.csv"
        poles.write_text("x,y,z\n%f,%f,%f\n%f,%f,%f\n" % (*CENTRE[:2], CENTRE[2] + 8, *CENTRE[:2], CENTRE[2] - 8))
        without = self.volume(self.solid, "--contours", path, "--rho", 0)
        report = self.report("segment", self.solid, "--contours", path, "--points", poles, "--points-space", "index", "--rho", 0, "-o", "s.vdb")
        self.assertTrue(report["automatic"]["start"].startswith("contours"))
        self.assertLess(abs(report["surface"]["volume"] / ELLIPSOID - 1), 0.5 * abs(without / ELLIPSOID - 1))
        self.assertLess(report["fit"]["points_to_surface"]["max"], 1)

    def test_a_thin_bright_body_is_no_line(self):
        # The marks lie on the wall of a thin rod, not on a bright line. The position inside that is compared with a
        # mark must not lie beyond the opposite wall, where the image is as dark as outside.
        x, y, z = (a - c for a, c in zip(world_lattice(), CENTRE_WORLD))
        image = self.inputs / "rod.nrrd"
        write_nrrd(image, 30 + 180 * np.clip((1 - np.hypot(x, y) / 2.2) * 2.2 / 0.5 + 0.5, 0, 1))
        path = self.table("rod.csv", [outline(2.2, k) for k in (2, 7, 12, 17, 22)])
        report = self.report("segment", image, "--contours", path, "-o", "s.vdb")
        self.assertEqual(report["resolved"]["edge_feature"], "slope")
        self.assertLess(abs(report["surface"]["volume"] / (math.pi * 2.2 ** 2 * SIZES[2] * SPACING[2]) - 1), 0.05)

    def test_points_far_away_tag_instead(self):
        path = self.table("near.csv", ellipsoid())
        far = self.inputs / "far.xyz"
        far.write_text("".join("%f %f %f\n" % tuple(np.add(ORIGIN, p)) for p in [(2, 2, 2), (2, 3, 2), (3, 2, 2)]))
        report = self.report("segment", self.solid, "--contours", path, "--points", far, "-o", "s.vdb", "--rho", 0)
        self.assertEqual(report["automatic"]["start"], "tag (points lie far from the contours' body)")

    def test_an_exterior_seed_in_the_body_tags_instead(self):
        seed = ",".join(map(str, CENTRE_WORLD))
        inner = [outline(5, k, 36) for k in range(8, 15)]  # walls of a cavity, without marks at its two ends along z
        report = self.report("segment", self.solid, "--contours", self.table("whole.csv", ellipsoid()), "-o", "s.vdb", "--rho", 0)
        whole = report["surface"]["volume"]
        cavity = self.report("segment", self.solid, "--contours", self.table("cavity.csv", ellipsoid() + inner), "-o", "c.vdb",
                             "--rho", 0, "--exterior-seed", seed)
        # The start is the body of the contours instead of tagging, because the exterior seed lies in the cavity, that
        # is outside this body.
        self.assertTrue(cavity["automatic"]["start"].startswith("contours"))
        self.assertGreater(whole - cavity["surface"]["volume"], math.pi * 25 * 6 * SPACING[2])
        shell = self.report("segment", self.solid, "--contours", self.table("whole.csv", ellipsoid()), "-o", "t.vdb", "--rho", 0,
                            "--exterior-seed", seed, "--max-steps", 1)
        self.assertEqual(shell["automatic"]["start"], "tag (an exterior seed lies inside the contours)")
        self.assertTrue(any("leave gaps" in line for line in shell["warnings"]))

    def test_what_the_marks_lie_on(self):
        path = self.table("all.csv", ellipsoid())
        solid = self.report("segment", self.solid, "--contours", path, "-o", "s.vdb")
        self.assertEqual(solid["resolved"]["edge_feature"], "slope")
        shell = self.report("segment", self.shell, "--contours", path, "-o", "s.vdb")
        self.assertEqual(shell["resolved"]["edge_feature"], "bright-line")
        self.assertIn("brighter than on both sides", shell["automatic"]["edge_feature"])
        dark = self.inputs / "dark.nrrd"
        raw = self.shell.read_bytes()
        head, body = raw.split(b"\n\n", 1)
        dark.write_bytes(head + b"\n\n" + (240 - np.frombuffer(body, np.uint8)).tobytes())
        self.assertEqual(self.report("segment", dark, "--contours", path, "-o", "s.vdb")["resolved"]["edge_feature"], "dark-line")
        # Marks 0.7 units of length inside the middle of the membrane, on every fourth slice. Between these slices, the
        # surface is expected to move outward to the middle of the membrane.
        beside = self.table("beside.csv", [outline(radius_at(k) - 0.7, k) for k in range(5, 18, 4)])
        volumes = {feature: self.volume(self.shell, "--contours", beside, "--edge-feature", feature)
                   for feature in ("bright-line", "slope")}
        alone = self.volume(self.shell, "--contours", beside, "--rho", 0, "--model", "paper")
        self.assertGreater(volumes["bright-line"], alone)
        self.assertGreater(volumes["bright-line"], volumes["slope"])

    def test_evidence_on_membranes(self):
        # The image shows the membrane only above the centre. Below, nothing supports the surface between the outlines.
        # The suggested position for a further mark is expected there.
        x, y, z = (a - c for a, c in zip(world_lattice(), CENTRE_WORLD))
        r = np.sqrt((x / 11) ** 2 + (y / 11) ** 2 + (z / 12) ** 2)
        image = self.inputs / "faded.nrrd"
        write_nrrd(image, 60 + 150 * np.exp(-0.5 * ((r - 1) * 11 / 0.6) ** 2) * (z > 0))
        path = self.table("sparse.csv", [outline(radius_at(k), k) for k in (4, 11, 18)])
        report = self.report("segment", image, "--contours", path, "-o", "s.vdb", "--suggest", 1, "--edge-feature", "bright-line",
                             "--attraction-range", 3)
        self.assertLess(report["evidence"]["suggestions"][0]["slice"], CENTRE[2])

    def test_reconstruct(self):
        world = self.inputs / "world.csv"
        with open(world, "w") as file:
            file.write("contour,x,y,z\n")
            for n, marks in enumerate(ellipsoid()):
                for p in marks:
                    file.write("%d,%f,%f,%f\n" % (n, *(o + s * v for o, s, v in zip(ORIGIN, SPACING, p))))
        report = self.report("reconstruct", "--contours", world, "-o", "s.vdb", "--voxel-size", 0.5)
        self.assertLess(abs(report["surface"]["volume"] / ELLIPSOID - 1), 0.02)
        (self.out / "s.vdb").unlink()
        self.refuse("reconstruct", "--contours", f"a={world}", "-o", "s.vdb", code=2, expected_text="several structures need an image")


class Formats(ContoursCase):
    """The same outlines as each program writes them give the same surface."""

    def same(self, path, *more):
        path_of_table = self.table("table.csv", ellipsoid(2))
        self.run_covol("segment", self.solid, "--contours", path_of_table, "-o", "a.vdb", "--rho", 0)
        self.run_covol("segment", self.solid, "--contours", path, "-o", "b.vdb", "--rho", 0, *more)
        alike = self.report("compare", "a.vdb", "b.vdb")["compare"]
        self.assertGreater(alike["dice"], 0.9999)
        # Coordinates in the two files may differ in the sixth digit. When close points are merged, such points may fall
        # into different cells, so that the surfaces differ by up to a tenth of a voxel.
        self.assertLess(alike["hausdorff"], 0.1 * min(SPACING))

    def test_fiji_roi_manager(self):
        path = self.inputs / "RoiSet.zip"
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            for marks in ellipsoid(2):
                k = marks[0][2]
                archive.writestr(f"{k + 1:04}-0036-0039.roi", roi(marks, k + 1))
        self.same(path)

    def test_napari_shapes(self):
        path = self.inputs / "shapes.csv"
        with open(path, "w") as file:
            file.write("index,shape-type,vertex-index,axis-0,axis-1,axis-2\n")
            for n, marks in enumerate(ellipsoid(2)):
                for v, (x, y, z) in enumerate(marks):
                    file.write(f"{n},polygon,{v},{z},{y:.5f},{x:.5f}\n")
        self.same(path)

    def test_world_coordinates(self):
        path = self.inputs / "world.csv"
        with open(path, "w") as file:
            file.write("x,y,z,contour\n")
            for n, marks in enumerate(ellipsoid(2)):
                for p in marks:
                    file.write("%.5f,%.5f,%.5f,%d\n" % (*(o + s * v for o, s, v in zip(ORIGIN, SPACING, p)), n))
        self.same(path)

    def test_several_files_are_one_structure(self):
        marks = ellipsoid(2)
        first, second = self.table("first.csv", marks[:3]), self.table("second.csv", marks[3:])
        path = self.table("table.csv", marks)
        self.run_covol("segment", self.solid, "--contours", path, "-o", "a.vdb", "--rho", 0)
        self.run_covol("segment", self.solid, "--contours", second, first, "-o", "b.vdb", "--rho", 0)
        self.assertGreater(self.report("compare", "a.vdb", "b.vdb")["compare"]["dice"], 0.9999)

    def test_hostile_files(self):
        bad = self.inputs / "bad.csv"
        for text, expected_text in [("slice,contour,x_px,y_px\n", "bad.csv"), ("slice,contour,x_px,y_px\n3,0,5\n", "bad.csv"),
                           ("slice,contour,x_px,y_px\n3,0,nan,5\n", "bad.csv"), ("x,y,z\n20,40,220\n21,41,221\n", "separate points"),
                           ("slice,contour,x_px,y_px\n3,0,10,10\n3,0,900,10\n3,0,10,20\n", "outside"),
                           ("contour,x,y,z\n0,20,40,210\n0,30,41,222\n0,25,50,230\n", "one slice")]:
            bad.write_text(text)
            self.refuse("segment", self.solid, "--contours", bad, "-o", "s.vdb", "--rho", 0, code=3, expected_text=expected_text)
        self.refuse("segment", self.solid, "--contours", "none.csv", "-o", "s.vdb", code=4, expected_text="none.csv")


class Several(ContoursCase):
    """An outer layer around a core, marked in one run."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.core = cls.inputs / "core.csv"
        write_table(cls.core, [outline(5, k, 36) for k in range(7, 16)])
        cls.layer = cls.inputs / "layer.csv"
        write_table(cls.layer, ellipsoid() + [outline(5, k, 36) for k in range(7, 16)])

    def test_layer_and_core(self):
        report = self.report("segment", self.solid, "--contours", f"layer={self.layer}", f"core={self.core}", "-o", "s.vdb",
                             "--mask", "m.seg.nrrd", "--table", "t.csv", "--rho", 0, "--mesh", "m.ply")
        self.assertEqual(self.files(), ["m.seg.nrrd", "m_core.ply", "m_layer.ply", "s.vdb", "t.csv"])
        layer, core = report["structures"]
        self.assertEqual((layer["name"], layer["label"], core["name"], core["label"]), ("layer", 1, "core", 2))
        self.assertEqual(core["input"]["contours"]["slices"], 9)
        self.assertEqual(core["input"]["points"]["count"], 9 * 36)
        self.assertEqual(core["input"]["points"]["densified"], core["input"]["contours"]["along"] + core["input"]["contours"]["between"])
        # A cylinder of 9 slices. The caps of the core are paraboloids one slice high, whose rims are rounded by
        # curvature.
        self.assertAlmostEqual(core["surface"]["volume"] / (math.pi * 25 * 9 * SPACING[2]), 1, delta=0.08)
        both = layer["surface"]["volume"] + core["surface"]["volume"]
        self.assertAlmostEqual(both / ELLIPSOID, 1, delta=0.03)
        self.assertEqual([r["structure"] for r in rows_of(self.out / "t.csv")], ["layer", "core"])

    def test_points_and_contours_together(self):
        points = self.inputs / "core.xyz"
        turns = np.pi * (3 - 5 ** 0.5) * np.arange(3000)
        up = 1 - (2 * np.arange(3000) + 1) / 3000
        ball = np.stack([np.sqrt(1 - up ** 2) * np.cos(turns), np.sqrt(1 - up ** 2) * np.sin(turns), up], axis=1)
        np.savetxt(points, np.array(CENTRE_WORLD) + 5 * ball, "%.4f")
        dirty = self.inputs / "dirty.xyz"
        dirty.write_text(points.read_text() + "".join("%f %f %f\n" % (ORIGIN[0] + n, ORIGIN[1] + 2 * n, ORIGIN[2]) for n in range(4)))
        report = self.report("segment", self.solid, "--points", f"core={dirty}", "--contours", f"whole={self.table('all.csv', ellipsoid())}",
                             "-o", "s.vdb", "--rho", 0, "--remove-outliers")
        core, whole = report["structures"]  # structures of --points precede those of --contours
        self.assertEqual((core["name"], whole["name"]), ("core", "whole"))
        self.assertEqual(core["input"]["points"]["cleanup"]["outliers"], 4)
        self.assertNotIn("contours", core["input"])
        self.assertLess(abs(core["surface"]["volume"] / (4 / 3 * math.pi * 125) - 1), 0.05)
        self.assertEqual(report["overlaps"][0]["inner"], "core")
        # Points and contours with the same name belong to one structure.
        both = self.report("segment", self.solid, "--points", f"core={points}", "--contours", f"core={self.core}", "-o", "t.vdb",
                           "--rho", 0)["structures"]
        self.assertEqual([s["name"] for s in both], ["core"])
        self.assertEqual(both[0]["input"]["points"]["count"], 3000 + 9 * 36)

    def test_names(self):
        self.refuse("segment", self.solid, "--contours", f"a={self.core}", self.layer, "-o", "s.vdb", code=2, expected_text="name")
        self.refuse("segment", self.solid, "--contours", self.core, "--points", f"a={self.layer}", "-o", "s.vdb", code=2, expected_text="name")
        self.refuse("segment", self.solid, "--contours", f"a={self.core}", "b=none.csv", "-o", "s.vdb", code=4, expected_text="none.csv")

    def test_a_grid_by_its_name(self):
        self.run_covol("segment", self.solid, "--contours", f"layer={self.layer}", f"core={self.core}", "-o", "s.vdb", "--rho", 0,
                       "--mask", "m.nrrd")
        for command in (("mesh", "{}", "-o", "m.ply"), ("mask", "{}", "--like", self.solid, "-o", "c.nrrd"),
                        ("render", "{}", "-o", "p.png"), ("compare", "{}", "s.vdb:core")):
            with self.subTest(command[0]):
                done = self.run_covol(*[str(a).format("s.vdb") for a in command])
                if command[0] != "render":  # render draws all level sets of a file
                    self.assertIn("'layer' is used, one of the level sets layer, core", done.stderr)
                done = self.run_covol(*[str(a).format("s.vdb:core") for a in command])
                self.assertNotIn("warning", done.stderr)
                self.assertIn("nobody", self.run_covol(*[str(a).format("s.vdb:nobody") for a in command], code=3).stderr)
        volume = self.report("mesh", "s.vdb:core", "-o", "m.ply")["surface"]["volume"]
        self.assertAlmostEqual(volume / (math.pi * 25 * 9 * SPACING[2]), 1, delta=0.08)
        self.assertGreater(self.report("compare", "s.vdb:core", "m.nrrd", "--label-b", 2)["compare"]["dice"], 0.98)
        self.assertLess(self.report("compare", "s.vdb:layer", "s.vdb:core")["compare"]["dice"], 0.01)
        # s.vdb:core was separated from the layer. As the start of a run for the core alone, it moves back to the marks.
        alone = self.report("segment", self.solid, "--contours", self.core, "-o", "alone.vdb", "--rho", 0)["surface"]["volume"]
        again = self.report("segment", self.solid, "--contours", self.core, "-o", "again.vdb", "--rho", 0, "--init", "vdb:s.vdb:core")
        self.assertIn("near its marks", again["automatic"]["start"])
        self.assertAlmostEqual(again["surface"]["volume"] / alone, 1, delta=0.01)

    def test_time_lapse(self):
        frames = []
        for t in range(3):
            x, y, z = (a - c for a, c in zip(world_lattice(), CENTRE_WORLD))
            r = np.sqrt(x ** 2 + y ** 2 + z ** 2)
            image = self.inputs / f"frame{t}.nrrd"
            write_nrrd(image, 30 + 180 * np.clip((7 + t - r) / 0.5 + 0.5, 0, 1))
            frames.append(image)
            radii = {k: math.sqrt(max(0, (7 + t) ** 2 - ((k - 11) * 1.5) ** 2)) for k in range(SIZES[2])}
            write_table(self.inputs / f"marks_{t}.csv", [outline(r, k) for k, r in radii.items() if r > 2.5])
        report = self.report("segment", *frames, "--contours", f"cell={self.inputs}/marks_{{frame}}.csv", "-o", "s.vdb", "--rho", 0)
        self.assertEqual(self.files(), ["s_t000.vdb", "s_t001.vdb", "s_t002.vdb"])
        for t, frame in enumerate(report["frames"]):
            cell, = frame["structures"]
            self.assertEqual(cell["input"]["contours"]["slices"], 9 if t == 0 else 11)
            self.assertAlmostEqual(cell["surface"]["volume"] / (4 / 3 * math.pi * (7 + t) ** 3), 1, delta=0.06)


@unittest.skipUnless(DATA, "SKIPPED: COVOL_DATA is not set")
class Embryo(Case):
    """Two tissues among membranes that look alike, 512 x 512 x 58, marked on every slice or on every fifth."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.folder = pathlib.Path(DATA) / "phantoms"
        cls.truth = tifffile.imread(cls.folder / "embryo_labels.tif")

    def dice(self, name, label, value):
        mask = tifffile.imread(self.out / name) == value
        truth = self.truth == label
        return 2 * (mask & truth).sum() / (mask.sum() + truth.sum())

    def both(self, ve, exe, *more):
        """Dice coefficients of VE and ExE from one run, and its report."""
        report = self.report("segment", self.folder / "embryo.tif", "--contours", f"ve={ve}", f"exe={exe}", "--exterior-seed",
                             "ve:89.6,89.6,28.5", "-o", "e.vdb", "--mask", "e.tif", *more)
        return self.dice("e.tif", 1, 1), self.dice("e.tif", 2, 2), report

    def every_fifth(self, phase):
        paths = []
        for tissue in ("ve", "exe"):
            rows = rows_of(self.folder / f"embryo_{tissue}_contours.csv")
            paths.append(self.inputs / f"{tissue}_{phase}.csv")
            with open(paths[-1], "w", newline="") as file:
                table = csv.DictWriter(file, rows[0].keys())
                table.writeheader()
                table.writerows(r for r in rows if int(r["slice"]) % 5 == phase)
        return paths

    def test_every_slice(self):
        contours = [self.folder / f"embryo_{t}_contours.csv" for t in ("ve", "exe")]
        ve, exe, report = self.both(*contours)
        self.assertGreaterEqual(ve, 0.98)
        self.assertGreaterEqual(exe, 0.985)
        self.assertEqual([s["resolved"]["edge_feature"] for s in report["structures"]], ["bright-line"] * 2)
        ve_marks, exe_marks, _ = self.both(*contours, "--rho", 0)
        self.assertGreaterEqual(ve, ve_marks - 0.003)
        self.assertGreaterEqual(exe, exe_marks - 0.003)

    def test_every_fifth_slice(self):
        for phase in (0, 3):
            with self.subTest(phase=phase):
                contours = self.every_fifth(phase)
                ve, exe, _ = self.both(*contours)
                self.assertGreaterEqual(ve, 0.95)
                self.assertGreaterEqual(exe, 0.96)
                ve_marks, exe_marks, _ = self.both(*contours, "--rho", 0)
                self.assertGreater(ve, ve_marks)
                self.assertGreater(exe, exe_marks)


if __name__ == "__main__":
    unittest.main()
