"""One file with the marks of several structures, and suggested positions for the programs in which people set marks.

    COVOL=build/bin/covol python3 -m unittest tests/cli/structure_column_test.py
"""
import csv
import json
import math
import struct
import unittest

from covol_case import H, ORIGIN, SIZE, Case, sphere_points, write_nrrd, write_xyz

RADIUS, LEFT, RIGHT = 3.5, (9.5, 19.5, 19.5), (29.5, 19.5, 19.5)  # radius and centres of two balls, in voxels


def on_ball(middle, count=80):
    """Positions in voxels, x, y, z."""
    around = sphere_points(count)
    centre = [sum(p[a] for p in around) / count for a in range(3)]
    size = math.dist(around[0], centre)
    return [tuple(m + RADIUS * (p[a] - centre[a]) / size for a, m in enumerate(middle)) for p in around]


def to_world(index):
    return tuple(o + H * i for o, i in zip(ORIGIN, index))


def multi_point(path, points, counters):
    """Fiji's .roi files of single points: whole pixels, each with its counter and slice."""
    n = len(points)
    head = bytearray(64)
    head[:4] = b"Iout"
    struct.pack_into(">h", head, 4, 228)
    head[6] = 10
    struct.pack_into(">H", head, 16, n)
    struct.pack_into(">I", head, 60, 64 + 4 * n)
    second = bytearray(64)
    struct.pack_into(">I", second, 48, 64 + 4 * n + 64)
    x, y = ([round(p[a]) for p in points] for a in (0, 1))
    slices = [(round(p[2]) + 1 << 8) + c for p, c in zip(points, counters)]
    path.write_bytes(bytes(head) + struct.pack(f">{2 * n}h", *x, *y) + bytes(second) + struct.pack(f">{n}i", *slices))


def cell_counter(path, points_of):
    """Markers of Fiji's Cell Counter: a type for each name, whole pixels, slices from 1."""
    types = "".join(
        f"<Marker_Type><Type>{n}</Type><Name>{name}</Name>" + "".join(
            "<Marker><MarkerX>%d</MarkerX><MarkerY>%d</MarkerY><MarkerZ>%d</MarkerZ></Marker>" % (round(x), round(y), round(z) + 1)
            for x, y, z in points) + "</Marker_Type>"
        for n, (name, points) in enumerate(points_of.items(), 1))
    path.write_text('<?xml version="1.0" encoding="UTF-8"?>\n<CellCounter_Marker_File><Image_Properties><Image_Filename>a.tif'
                    f"</Image_Filename></Image_Properties><Marker_Data><Current_Type>1</Current_Type>{types}</Marker_Data>"
                    "</CellCounter_Marker_File>\n")


class TwoBalls(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.scene = cls.inputs / "balls.nrrd"
        distance = lambda at: min(math.dist(at, LEFT), math.dist(at, RIGHT))  # noqa: E731
        write_nrrd(cls.scene, (SIZE,) * 3, bytes(
            int(20 + 200 * min(1, max(0, RADIUS - distance((i, j, k)) + 0.5)))
            for k in range(SIZE) for j in range(SIZE) for i in range(SIZE)))
        cls.marks = {"left": on_ball(LEFT), "right": on_ball(RIGHT)}


class Columns(TwoBalls):
    def volumes(self, *points):
        """Marks by structure."""
        report = self.report("segment", self.scene, "--points", *points, "-o", "s.vdb", "--mask", "m.nrrd")
        return {s["name"]: s["surface"]["volume"] for s in report["structures"]}

    def two_files(self):
        files = []
        for name, points in self.marks.items():
            write_xyz(self.inputs / f"{name}.xyz", [to_world(p) for p in points])
            files.append(f"{name}={self.inputs / name}.xyz")
        return files

    def write(self, name, header, rows):
        path = self.inputs / name
        with open(path, "w", newline="") as file:
            csv.writer(file).writerows([header, *rows])
        return path

    def mixed(self):
        """Marks of both structures in turn, with the structures' names."""
        for pair in zip(*self.marks.values()):
            yield from zip(self.marks, pair)

    def test_a_column_is_as_good_as_two_files(self):
        table = self.write("both.csv", ["x", "y", "z", "Cell"], [[*("%.6f" % v for v in to_world(p)), name] for name, p in self.mixed()])
        self.assertEqual(self.volumes(table, "--structure-column", "cell"), self.volumes(*self.two_files()))

    def test_napari_fiji_and_slicer(self):
        truth = self.volumes(*self.two_files())
        rows = list(self.mixed())
        napari = self.write("napari.csv", ["index", "axis-0", "axis-1", "axis-2", "label"],
                            [[n, p[2], p[1], p[0], name] for n, (name, p) in enumerate(rows)])
        controls = [{"id": str(n), "label": name, "position": to_world(p)} for n, (name, p) in enumerate(rows)]
        nodes = [{"type": "Fiducial", "coordinateSystem": "LPS", "name": name, "controlPoints": [c for c in controls if c["label"] == name]}
                 for name in self.marks]
        (self.inputs / "nodes.mrk.json").write_text(json.dumps({"markups": nodes}))
        (self.inputs / "labels.mrk.json").write_text(json.dumps({"markups": [{**nodes[0], "controlPoints": controls}]}))
        fcsv = "# CoordinateSystem = LPS\n# columns = id,x,y,z,label\n" + "".join(
            f"{n},{x},{y},{z},{name}\n" for n, (name, p) in enumerate(rows) for x, y, z in [to_world(p)])
        (self.inputs / "old.fcsv").write_text(fcsv)
        for path, column in ((napari, "label"), (self.inputs / "nodes.mrk.json", "node"), (self.inputs / "labels.mrk.json", "label"),
                             (self.inputs / "old.fcsv", "label")):
            with self.subTest(path.name):
                volumes = self.volumes(path, "--structure-column", column)
                self.assertEqual(list(volumes), list(truth))
                for name, volume in volumes.items():
                    self.assertAlmostEqual(volume / truth[name], 1, delta=1e-3)
        multi_point(self.inputs / "m.roi", [p for _, p in rows], [list(self.marks).index(name) for name, _ in rows])
        volumes = self.volumes(self.inputs / "m.roi", "--structure-column", "counter")
        self.assertEqual(list(volumes), ["counter 0", "counter 1"])
        for volume, true in zip(volumes.values(), truth.values()):
            self.assertAlmostEqual(volume / true, 1, delta=0.2)  # coordinates in the .roi are whole pixels
        cell_counter(self.inputs / "cells.xml", self.marks)
        by_type = self.volumes(self.inputs / "cells.xml", "--structure-column", "type")
        self.assertEqual(list(by_type), list(self.marks))
        for volume, same in zip(by_type.values(), volumes.values()):
            self.assertAlmostEqual(volume / same, 1, delta=0.01)  # same marks as in m.roi, in another order

    def test_lines_keep_together(self):
        rows = []
        for name, middle in (("left", LEFT), ("right", RIGHT)):
            for k in range(17, 23):
                r = math.sqrt(RADIUS ** 2 - (k - middle[2]) ** 2)
                rows += [[name, k, 1, middle[0] + r * math.cos(t), middle[1] + r * math.sin(t)]
                         for t in (math.pi * n / 8 for n in range(16))]
        table = self.write("outlines.csv", ["cell", "slice", "contour", "x_px", "y_px"], rows)
        report = self.report("segment", self.scene, "--contours", table, "--structure-column", "cell", "-o", "s.vdb")
        for one in report["structures"]:
            self.assertEqual(one["input"]["contours"]["closed"], 6)
            # A wide tolerance: the body is seven voxels across.
            self.assertAlmostEqual(one["surface"]["volume"] / (4 / 3 * math.pi * (RADIUS * H) ** 3), 1, delta=0.25)

    def test_what_does_not_fit_is_reported(self):
        table = self.write("both.csv", ["x", "y", "z", "cell"], [[*to_world(p), name] for name, p in self.mixed()])
        command = ("segment", self.scene, "-o", "s.vdb", "--structure-column")
        self.assertIn("x, y, z, cell", self.refuse(*command, "label", "--points", table, code=3, expected_text="--structure-column"))
        self.refuse(*command, "cell", "--points", f"a={table}", code=2, expected_text="a=")
        write_xyz(self.inputs / "plain.xyz", [to_world(p) for p in self.marks["left"]])
        self.refuse(*command, "cell", "--points", self.inputs / "plain.xyz", code=3, expected_text="--structure-column")
        empty = self.write("empty.csv", ["x", "y", "z", "cell"], [[1, 2, 3, "a"], [1, 2, 4, ""]])
        self.refuse(*command, "cell", "--points", empty, code=3, expected_text="empty.csv:3")


class Suggestions(TwoBalls):
    """If the image has no edge, all of the surface that is far from the marks is unsupported."""

    def half_marked(self):
        image, half = self.inputs / "grey.nrrd", self.inputs / "half.xyz"
        write_nrrd(image, (SIZE,) * 3, bytes(
            200 if k < RIGHT[2] and math.dist((i, j, k), RIGHT) < RADIUS else 20
            for k in range(SIZE) for j in range(SIZE) for i in range(SIZE)))
        write_xyz(half, [to_world(p) for p in on_ball(RIGHT, 300) if p[2] < RIGHT[2] + 0.5])
        return "segment", image, "--points", half, "--rho", 0, "-o", "s.vdb"

    def test_programs_open_them_where_they_lie(self):
        run = (*self.half_marked(), "--suggest", 2)
        self.refuse(*run, "--suggestions", "s.txt", code=3, expected_text=".mrk.json")
        for name, tolerance in (("n.csv", 1e-9), ("s.mrk.json", 1e-9), ("f.roi", 0.51)):
            with self.subTest(name):
                places = self.report(*run, "--suggestions", name)["evidence"]["suggestions"]
                self.assertGreater(len(places), 0)
                self.run_covol("convert", name, "back.csv", "--like", self.scene, "--quiet")
                lines = [line for line in (self.out / "back.csv").read_text().splitlines() if not line.startswith("#")]
                rows = list(csv.reader(lines[1:]))
                self.assertEqual(len(rows), len(places))
                for row, place in zip(rows, places):
                    for found, true in zip(map(float, row), place["world"]):
                        self.assertLessEqual(abs(found - true), tolerance * H + 1e-6)

    def test_three_where_no_number_is_given(self):
        places = self.report(*self.half_marked(), "--suggestions", "n.csv")["evidence"]["suggestions"]
        self.assertIn(len(places), (1, 2, 3))
        self.assertEqual(len((self.out / "n.csv").read_text().splitlines()), len(places) + 1)


if __name__ == "__main__":
    unittest.main()
