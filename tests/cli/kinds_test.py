"""Painted labels, seeds and another tool's mask as marks, with the real binary.

    COVOL=build/bin/covol python3 -m unittest tests/cli/kinds_test.py
"""
import unittest

import numpy as np
import tifffile

from covol_case import Case, write_nrrd
from structures_case import H, ORIGIN, SIZE, ball_image, fibonacci, lattice, nrrd_keys, write_points

MIDDLE = (0.0, 0.0, 0.0)
RADIUS = 7.0  # in units of length; 14 voxels


def ball(center=MIDDLE, radius=RADIUS):
    x, y, z = lattice()
    return (x - center[0]) ** 2 + (y - center[1]) ** 2 + (z - center[2]) ** 2 < radius ** 2


def on_slices(mask, step, first=0, axis=0):
    """The mask on every step-th slice; axis 0 is z."""
    keep = np.zeros(mask.shape[axis], bool)
    keep[first::step] = True
    return np.where(np.expand_dims(keep, tuple(a for a in range(3) if a != axis)), mask, 0)


def write_labels(path, labels, kind="uint8", keys=()):
    write_nrrd(path, (SIZE,) * 3, np.asarray(labels).astype(kind).tobytes(), spacing=H, origin=ORIGIN, kind=kind)
    if keys:
        header, pixels = path.read_bytes().split(b"\n\n", 1)
        path.write_bytes(header + "".join(f"\n{k}:={v}" for k, v in keys).encode() + b"\n\n" + pixels)


def read_labels(path):
    header, pixels = path.read_bytes().split(b"\n\n", 1)
    text = header.decode()
    if "gzip" in text:
        import zlib
        pixels = zlib.decompress(pixels, 47)
    kind = {"unsigned char": "u1", "uint8": "u1", "int": "<i4", "int32": "<i4"}[text.split("type: ")[1].splitlines()[0]]
    return np.frombuffer(pixels, kind).reshape((SIZE,) * 3)


def dice(a, b):
    return 2 * np.count_nonzero(a & b) / (np.count_nonzero(a) + np.count_nonzero(b))


class KindsCase(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.image = cls.inputs / "ball.nrrd"
        write_nrrd(cls.image, (SIZE,) * 3, ball_image(MIDDLE, RADIUS).tobytes(), spacing=H, origin=ORIGIN)

    def labels(self, name, values, **more):
        path = self.inputs / name
        write_labels(path, values, **more)
        return path


class Painted(KindsCase):
    def test_slices_become_a_body(self):
        paint = self.labels("paint.nrrd", 4 * on_slices(ball(), 4, 2))
        report = self.report("segment", self.image, "--painted", paint, "-o", "s.vdb", "--mask", "m.nrrd")
        reported, = report["input"]["painted"]
        self.assertEqual(reported["label"], 4)
        self.assertEqual(reported["slices"], [{"axis": "z", "slices": [10, 14, 18, 22, 26, 30, 34], "outlines": 7}])
        self.assertEqual(reported["scribbled"], 0)
        self.assertIn("7 slices across z (10, 14, 18, 22, 26, 30, 34) taken as completely painted", reported["understood"])
        mask = read_labels(self.out / "m.nrrd")
        self.assertEqual(sorted(np.unique(mask)), [0, 4])
        self.assertGreater(dice(mask > 0, ball()), 0.96)

    def test_slices_side_by_side_become_a_body(self):
        # The ball covers slices 10 to 37. Either all of them are painted except two at each end, or only the 16 in the
        # middle.
        for first, last in ((12, 36), (16, 32)):
            with self.subTest(first):
                some = np.zeros((SIZE,) * 3, bool)
                some[first:last] = ball()[first:last]
                report = self.report("segment", self.image, "--painted", self.labels("run.nrrd", some), "-o", "s.vdb", "--mask", "m.nrrd")
                reported, = report["input"]["painted"]
                self.assertEqual(reported["slices"][0]["axis"], "z")
                self.assertEqual(reported["slices"][0]["slices"], list(range(first, last)))
                self.assertEqual(reported["scribbled"], 0)
                self.assertGreater(dice(read_labels(self.out / "m.nrrd") > 0, ball()), 0.99 * dice(some, ball()))

    def test_reports_what_it_understood(self):
        paint = self.labels("paint.nrrd", on_slices(ball(), 4, 2))
        result = self.run_covol("segment", self.image, "--painted", paint, "-o", "s.vdb")
        self.assertIn("label 1: ", result.stderr)
        self.assertIn("taken as completely painted", result.stderr)

    def test_several_labels_keep_values_and_names(self):
        x, _, _ = lattice()
        halves = np.where(x < 0.1, 300, 7) * ball()
        keys = [("Segment0_ID", "a"), ("Segment0_Name", "left half"), ("Segment0_LabelValue", 300), ("Segment1_Name", "right"),
                ("Segment1_LabelValue", 7)]
        paint = self.labels("two.seg.nrrd", on_slices(halves, 4, 2), kind="uint16", keys=keys)
        report = self.report("segment", self.image, "--painted", paint, "--rho", 0, "-o", "s.vdb", "--mask", "m.seg.nrrd")
        self.assertEqual([(s["name"], s["label"]) for s in report["structures"]], [("right", 7), ("left half", 300)])
        mask = read_labels(self.out / "m.seg.nrrd")
        self.assertEqual(sorted(np.unique(mask)), [0, 7, 300])
        for value in (7, 300):
            self.assertGreater(dice(mask == value, halves == value), 0.93)
        header = nrrd_keys(self.out / "m.seg.nrrd")
        self.assertEqual((header["Segment0_Name"], header["Segment0_LabelValue"]), ("right", "7"))
        self.assertEqual((header["Segment1_Name"], header["Segment1_LabelValue"]), ("left half", "300"))

    def test_a_tiff_without_spacing_takes_the_images_geometry(self):
        path = self.inputs / "paint.tif"
        tifffile.imwrite(path, on_slices(ball(), 5, 3).astype(np.uint8))
        report = self.report("segment", self.image, "--painted", path, "-o", "s.vdb", "--mask", "m.nrrd")
        self.assertEqual(report["input"]["painted"][0]["slices"][0]["axis"], "z")
        self.assertGreater(dice(read_labels(self.out / "m.nrrd") > 0, ball()), 0.95)

    def test_paint_of_one_label_goes_with_points(self):
        paint = self.labels("paint.nrrd", on_slices(ball(), 6, 2))
        points = self.inputs / "p.xyz"
        write_points(points, RADIUS * fibonacci(60))
        report = self.report("segment", self.image, "--painted", paint, "--points", points, "-o", "s.vdb")
        self.assertGreater(report["input"]["points"]["count"], 60)
        self.assertNotIn("structures", report)

    def test_scribbles_are_seeds_on_both_sides(self):
        both = np.zeros((SIZE,) * 3)
        both[ball((-4, 0, 0), 1.6)] = 1
        both[ball((4, 0, 0), 1.6)] = 2
        paint = self.labels("blobs.nrrd", both)
        report = self.report("segment", self.image, "--painted", paint, "-o", "s.vdb", "--max-steps", 2)
        for s in report["structures"]:
            self.assertEqual(s["input"]["painted"][0]["slices"], [])
            self.assertGreater(s["seeds"]["inside"], 20)
            self.assertGreater(s["seeds"]["outside"], 20)

    def test_an_outside_label(self):
        paint = on_slices(ball(), 4, 2).astype(np.uint8)
        paint[22, 2:5, 2:40] = 9
        path = self.labels("paint.nrrd", paint)
        report = self.report("segment", self.image, "--painted", path, "--painted-outside", 9, "-o", "s.vdb")
        self.assertEqual(report["seeds"]["outside"], 3 * 38)
        self.assertEqual(report["seeds"]["wrong"], 0)

    def test_paint_is_not_called_seeds(self):
        # The specks of paint at the tip of the cone are not taken as complete cross-sections, and the body ends before
        # them. The warning about these voxels must call them paint, not seeds.
        x, y, z = lattice()
        cone = (np.hypot(x, y) < 0.35 * (8 - z)) & (abs(z) < 9)
        cone[[k for k in range(SIZE) if k % 5 not in (1, 2)]] = False
        result = self.run_covol("segment", self.image, "--painted", self.labels("cone.nrrd", cone), "--rho", 0, "-o", "s.vdb")
        self.assertRegex(result.stderr, r"warning: paint: (\d+) of \1 painted voxels lie on the wrong side")
        self.assertNotIn("seeds", result.stderr)

    def test_mistakes(self):
        empty = self.labels("empty.nrrd", np.zeros((SIZE,) * 3))
        paint = self.labels("paint.nrrd", on_slices(ball(), 4, 2))
        elsewhere = self.inputs / "elsewhere.nrrd"
        write_nrrd(elsewhere, (SIZE,) * 3, on_slices(ball(), 4, 2).astype(np.uint8).tobytes(), spacing=H, origin=(100, 0, 0))
        small = self.inputs / "small.tif"
        tifffile.imwrite(small, np.ones((5, 6, 7), np.uint8))
        for arguments, expected in (
                (("--painted", empty), "expected painted voxels, got 0 everywhere in 48 x 48 x 48"),
                (("--painted", elsewhere), "painted voxels lie outside the image, the first at"),
                (("--painted", small), "expected as many voxels as the image, 48 x 48 x 48"),
                (("--painted", paint, "--painted-outside", 3), "expected the outside label 3 among its labels, got 1")):
            self.assertIn(expected, self.run_covol("segment", self.image, *arguments, "-o", "s.vdb", code=3).stderr)
        two = self.labels("two.nrrd", on_slices(np.where(lattice()[0] < 0, 1, 2) * ball(), 4, 2))
        self.assertIn("expected one label in a file with a name, got 2",
                      self.run_covol("segment", self.image, "--painted", f"a={two}", "-o", "s.vdb", code=2).stderr)


class Seeds(KindsCase):
    def cloud(self, name, radius, count=40):
        path = self.inputs / name
        write_points(path, radius * fibonacci(count))
        return path

    def test_seeds_beside_marks_are_checked(self):
        marks = self.cloud("marks.xyz", RADIUS, 600)
        report = self.report("segment", self.image, "--points", marks, "--inside", "0,0,0", "--outside", "9,9,9", "--outside",
                             self.cloud("out.xyz", 10), "-o", "s.vdb")
        self.assertEqual(report["seeds"], {"inside": 1, "outside": 41, "wrong": 0, "wrong_inside": 0, "wrong_outside": 0})
        # The inside seed lies outside the ball, and thus contradicts 600 marks and the edge of the image. The result is
        # still the ball, with a warning about the seed.
        for model in ([], ["--model", "paper"]):
            result = self.run_covol("segment", self.image, "--points", marks, "--inside", "9,0,0", "-o", "s.vdb", "--mask", "m.nrrd", *model)
            self.assertIn("1 of 1 seeds lie on the wrong side of the surface", result.stderr)
            self.assertGreater(dice(read_labels(self.out / "m.nrrd") > 0, ball()), 0.97)

    def test_seeds_alone_are_a_start(self):
        # Inside seeds lie at a radius of 4, outside seeds at 9. Without steps, the surface is halfway: at 6.5.
        for count, minimum in ((40, 0.9), (300, 0.95)):
            with self.subTest(count):
                report = self.report("segment", self.image, "--inside", self.cloud("in.xyz", 4, count), "--outside",
                                     self.cloud("out.xyz", 9, count), "-o", "s.vdb", "--mask", "m.nrrd", "--max-steps", 0)
                self.assertIn("halfway between seeds", report["automatic"]["start"])
                self.assertGreater(dice(read_labels(self.out / "m.nrrd") > 0, ball(radius=6.5)), minimum)

    def test_mistakes(self):
        self.assertIn("inside and outside", self.run_covol("segment", self.image, "--inside", "1,1,1", "--outside", "1,1,1", "-o", "s.vdb", code=3).stderr)
        self.assertIn("outside", self.run_covol("segment", self.image, "--inside", "1000,1,1", "-o", "s.vdb", code=3).stderr)
        self.assertIn("no structure is called 'b'", self.run_covol(
            "segment", self.image, "--points", f"a={self.cloud('marks.xyz', RADIUS, 600)}", "--outside", "b=1,1,1", "-o", "s.vdb", code=2).stderr)


class Starts(KindsCase):
    def marks(self, count, name="marks.csv"):
        path = self.inputs / name
        write_points(path, [tuple(RADIUS * v for v in p) for p in fibonacci(count)])
        return path

    def test_the_image_alone_grows_from_a_sphere_or_a_seed(self):
        # Starts in the middle of the ball, far from its edge, and closer to the edge.
        for place, radius in (("0,0,0", 1.5), ("4,0,0", 1.5), ("0,-3,3", 2)):
            with self.subTest(place):
                report = self.report("segment", self.image, "--theta", 0, "--init", f"sphere:{place},{radius}", "-o", "s.vdb", "--mask", "m.nrrd")
                self.assertIn("to edges", report["automatic"]["growth"])
                self.assertGreater(dice(read_labels(self.out / "m.nrrd") > 0, ball()), 0.95)
        # With the paper's model, a start far from the edge does not grow towards it, and vanishes by its curvature.
        for name in self.files():
            (self.out / name).unlink()
        self.refuse("segment", self.image, "--theta", 0, "--init", "sphere:0,0,0,1.5", "--model", "paper", "-o", "p.vdb", code=3, expected_text="vanished")

    def test_a_guess_flows_by_the_model_of_the_paper(self):
        marks = self.marks(600)
        report = self.report("segment", self.image, "--points", marks, "--rho", 0, "--init", "guess", "--model", "paper", "-o", "s.vdb")
        self.assertGreater(report["solve"]["steps"], 0)
        self.assertGreater(report["surface"]["volume"], 0.8 * 4 / 3 * np.pi * RADIUS ** 3)
        rested = self.report("segment", self.image, "--points", marks, "--rho", 0, "-o", "s.vdb")
        self.assertEqual(rested["solve"]["steps"], 0)
        self.assertLess(abs(rested["surface"]["volume"] / (4 / 3 * np.pi * RADIUS ** 3) - 1), 0.01)

    def test_flags_that_did_nothing_are_named(self):
        done = self.run_covol("segment", self.image, "--points", self.marks(60), "--delta", "0.1vx", "--tau", "1vx", "-o", "s.vdb")
        self.assertIn("--delta, --tau had no effect", done.stderr)
        done = self.run_covol("segment", self.image, "--points", self.marks(60), "--delta", "0.1vx", "--model", "paper", "-o", "s.vdb")
        self.assertNotIn("had no effect", done.stderr)

    def test_an_outline_on_the_first_slice_is_the_outline_of_the_cut(self):
        # The first slice of the image cuts the ball below its centre. Of the three outlines, one lies on this first
        # slice: its marks must not be taken for marks all over the cut.
        z = np.arange(SIZE) * H + ORIGIN[2]
        center = (0.0, 0.0, z[0] + 3.0)
        image = self.inputs / "cut.nrrd"
        write_nrrd(image, (SIZE,) * 3, ball_image(center, RADIUS).tobytes(), spacing=H, origin=ORIGIN)
        turns = 2 * np.pi * np.arange(16) / 16
        marks = []
        for height in (0.0, 4.0, 8.0):
            r = np.sqrt(RADIUS ** 2 - (height - 3.0) ** 2)
            marks += [(r * np.cos(t), r * np.sin(t), z[0] + height) for t in turns]
        path = self.inputs / "outlines.csv"
        write_points(path, marks)
        report = self.report("segment", image, "--points", path, "--rho", 0, "-o", "s.vdb", "--mask", "m.nrrd")
        self.assertNotIn("lie in the cut", report["automatic"]["guess"])
        self.assertGreater(dice(read_labels(self.out / "m.nrrd") > 0, ball(center)), 0.95)

    def test_two_bodies_are_reported(self):
        path = self.inputs / "two.csv"
        write_points(path, [(x + 3 * p[0], 3 * p[1], 3 * p[2]) for x in (-4, 4) for p in fibonacci(60)])
        done = self.run_covol("segment", self.image, "--points", path, "--rho", 0, "-o", "two.vdb")
        self.assertIn("through the marks has 2 pieces", done.stderr)
        done = self.run_covol("segment", self.image, "--points", self.marks(60), "--rho", 0, "-o", "two.vdb")
        self.assertNotIn("pieces", done.stderr)

    def test_one_more_mark_on_the_last_result(self):
        self.run_covol("segment", self.image, "--points", self.marks(60), "--rho", 0, "-o", "first.vdb")
        more = self.inputs / "more.csv"
        write_points(more, [tuple(RADIUS * v for v in p) for p in fibonacci(60)] + [(RADIUS + 3 * H, 0, 0)])
        again = self.report("segment", self.image, "--points", more, "--rho", 0, "--init", "vdb:first.vdb", "-o", "again.vdb")
        self.assertIn("near its marks", again["automatic"]["start"])
        self.assertEqual(again["solve"]["steps"], 0)
        self.assertLess(again["fit"]["points_to_surface"]["max"], 0.5 * H)
        # The further mark changes the surface only near itself.
        far = self.report("compare", "first.vdb", "again.vdb")["compare"]
        self.assertGreater(far["dice"], 0.98)


class Guess(KindsCase):
    """A ball's mask that lacks a cap and has a bump."""

    def setUp(self):
        super().setUp()
        x, _, _ = lattice()
        self.wrong = (ball() & (x < 4.5)) | ball((-6.5, 0, 0), 2.5)
        self.marks = self.inputs / "marks.xyz"
        directions = np.array([[1, 0, 0], [1, 0.35, 0], [1, -0.35, 0], [1, 0, 0.35], [1, 0, -0.35],
                               [-1, 0, 0], [-1, 0.2, 0], [-1, -0.2, 0], [-1, 0, 0.2], [-1, 0, -0.2]])
        write_points(self.marks, RADIUS * directions / np.linalg.norm(directions, axis=1, keepdims=True))

    def test_marks_correct_a_mask_and_leave_the_rest(self):
        mask = self.labels("mask.nrrd", 200 * self.wrong)
        report = self.report("segment", self.image, "--guess", mask, "--points", self.marks, "-o", "s.vdb", "--mask", "m.nrrd",
                             "--suggest", 2)
        new = read_labels(self.out / "m.nrrd")
        self.assertEqual(sorted(np.unique(new)), [0, 200])
        before, after = dice(self.wrong, ball()), dice(new > 0, ball())
        self.assertGreater(after, before + 0.5 * (1 - before))
        changed = (new > 0) != self.wrong
        reported = report["correction"]
        self.assertEqual(reported["marks"], 10)
        self.assertEqual(reported["mask"]["added"] + reported["mask"]["removed"], np.count_nonzero(changed))
        self.assertLess(reported["marks_to_corrected"]["max"], H)
        # Voxels that are farther from all marks than the largest radius of a correction are unchanged.
        x, y, z = lattice()
        points = np.loadtxt(self.marks)
        nearest = np.min([np.sqrt((x - p[0]) ** 2 + (y - p[1]) ** 2 + (z - p[2]) ** 2) for p in points], axis=0)
        self.assertFalse(np.any(changed & (nearest >= reported["radius"]["largest"])))
        # Without the five marks on the missing cap, nothing supports the surface there, and marks are suggested.
        some = self.inputs / "some.xyz"
        write_points(some, points[5:])
        half = self.report("segment", self.image, "--guess", mask, "--points", some, "-o", "h.vdb", "--suggest", 2)
        self.assertGreater(len(half["evidence"]["suggestions"]), 0)
        self.assertEqual(report["solve"]["steps"], 0)

    def test_other_labels_stay(self):
        labels = np.where(self.wrong, 3, 0)
        labels[:, :, :4] = 8
        mask = self.labels("mask.nrrd", labels)
        common = ("segment", self.image, "--guess", mask, "--points", self.marks, "-o", "s.vdb", "--mask", "m.nrrd")
        self.assertIn("expected one label, got 3, 8; choose one with --guess-label", self.run_covol(*common, code=3).stderr)
        self.assertIn("expected one of the labels", self.run_covol(*common, "--guess-label", 5, code=3).stderr)
        self.assertIn("keeps its values", self.run_covol(*common, "--guess-label", 3, "--mask-label", 7).stderr)
        new = read_labels(self.out / "m.nrrd")
        self.assertTrue(np.array_equal(new == 8, labels == 8))
        self.assertGreater(dice(new == 3, ball()), dice(self.wrong, ball()))

    def test_without_marks_it_stays_and_suggestions_show_where_to_look(self):
        mask = self.labels("mask.nrrd", self.wrong)
        report = self.report("segment", self.image, "--guess", mask, "-o", "s.vdb", "--mask", "m.nrrd", "--suggest", 1)
        self.assertTrue(np.array_equal(read_labels(self.out / "m.nrrd"), self.wrong.astype(np.uint8)))
        self.assertEqual(len(report["evidence"]["suggestions"]), 1)

    def test_a_level_set_and_a_mesh(self):
        mask = self.labels("mask.nrrd", self.wrong)
        self.report("segment", self.image, "--guess", mask, "-o", "g.vdb", "--mesh", "g.ply")
        for guess in ("g.vdb", "g.ply"):
            report = self.report("segment", self.image, "--guess", self.out / guess, "--points", self.marks, "-o", "s.vdb", "--mask", "m.nrrd")
            self.assertGreater(dice(read_labels(self.out / "m.nrrd") > 0, ball()), 0.97)
            self.assertEqual(report["correction"]["marks"], 10)

    def test_seeds_correct_it_too(self):
        mask = self.labels("mask.nrrd", self.wrong)
        report = self.report("segment", self.image, "--guess", mask, "--inside", "5.5,0,0", "--outside", "-8,0,0", "-o", "s.vdb")
        self.assertEqual(report["correction"]["seeds"], 2)
        self.assertEqual(report["seeds"]["wrong"], 0)


if __name__ == "__main__":
    unittest.main()
