"""Tables of marks as programs write them, or people.

    COVOL=build/bin/covol python3 -m unittest tests/cli/cases_tables_test.py
"""
import unittest

from cases_case import SIZE, Case, body, on_body

try:
    import numpy as np
    MISSING = ""
except ImportError as error:
    MISSING = f"SKIPPED: {error}; see tests/install_packages.sh"


def rows(points, separator=",", form="{:.5f}", comma=False):
    lines = [separator.join(form.format(v).replace(".", "," if comma else ".") for v in p) for p in points]
    return "\n".join(lines) + "\n"


@unittest.skipIf(MISSING, MISSING)
class TablesCase(Case):
    def setUp(self):
        super().setUp()
        self.points = on_body(40)

    def read(self, name, text, points=None, encoding="utf-8"):
        """Checks that covol's conversion has the intended marks."""
        (self.folder / name).write_bytes(text if isinstance(text, bytes) else text.encode(encoding))
        self.run_covol("convert", name, "out.xyz", "--quiet")
        out = np.loadtxt(self.folder / "out.xyz", ndmin=2)
        np.testing.assert_allclose(out, self.points if points is None else points, atol=1e-4)
        return self.report("info", name)["points"]["rule"]

    def write_image(self, name="image.nrrd", spacing=(1, 1, 1), origin=(0, 0, 0), unit="um"):
        header = ["NRRD0005", "type: uint8", "dimension: 3", "space: LPS", "sizes: %d %d %d" % SIZE,
                  "space directions: (%r,0,0) (0,%r,0) (0,0,%r)" % spacing, "space origin: (%r,%r,%r)" % origin,
                  "encoding: raw", f'space units: "{unit}" "{unit}" "{unit}"']
        (self.folder / name).write_bytes("\n".join(header).encode() + b"\n\n" + body().tobytes())
        return name


class Dialects(TablesCase):
    def test_decimal_commas(self):
        quoted = "id,X,Y,Z\n" + "".join(f"{n}," + ",".join(f'"{v:.5f}"'.replace(".", ",") for v in p) + "\n"
                                        for n, p in enumerate(self.points))
        for name, text in (("tab.txt", rows(self.points, "\t", comma=True)), ("tab.csv", rows(self.points, "\t", comma=True)),
                           ("blank.txt", rows(self.points, " ", comma=True)), ("blanks.xyz", rows(self.points, "   ", comma=True)),
                           ("semicolon.csv", "x;y;z\n" + rows(self.points, ";", comma=True)), ("quoted.csv", quoted),
                           ("named.tsv", "x\ty\tz\n" + rows(self.points, "\t", comma=True)),
                           ("named.txt", "x y z\n" + rows(self.points, " ", comma=True)),
                           ("excel.csv", "sep=;\nx;y;z\n" + rows(self.points, ";", comma=True)),
                           ("pointed.csv", rows(self.points, ", "))):
            with self.subTest(name):
                self.read(name, text)

    def test_thousands(self):
        points = np.round(self.points * 1000, 3)
        self.read("a.csv", "x;y;z\n" + "".join(";".join(f"{v:,.3f}".translate(str.maketrans(",.", ".,")) for v in p) + "\n" for p in points), points)
        self.read("b.csv", "x,y,z\n" + "".join(",".join(f'"{v:,.3f}"' for v in p) + "\n" for p in points), points)

    def test_whole_numbers_among_decimal_commas(self):
        points = np.round(self.points * 2) / 2
        text = "\n".join(" ".join(f"{v:g}".replace(".", ",") for v in p) for p in points)
        self.read("a.txt", text, points)

    def test_sixteen_bits(self):
        for encoding in ("utf-16", "utf-16-le", "utf-16-be"):
            for name, text in (("a.csv", "x [\xb5m],y [\xb5m],z [\xb5m]\n" + rows(self.points)), ("a.txt", rows(self.points, "\t"))):
                with self.subTest(name, encoding=encoding):
                    self.read(name, text, encoding=encoding)

    def test_what_is_no_table_is_refused(self):
        for text, message in (("a,b,c\n1,2,3\n", "expected columns named x, y, z"), ("x,y,z\n1,2,three\n", "got 'three'"),
                              ("1 2\n1 2 3\n", "expected 3 numbers, got 2"), ("hello\n", "expected 3 numbers, got 1"),
                              ("x,y,z\nNA,NA,NA\n1,2,3\n", "got 'NA'")):
            with self.subTest(text):
                (self.folder / "a.csv").write_text(text)
                self.assertIn(message, self.refused("info", "a.csv"))


class Programs(TablesCase):
    def test_trackmate(self):
        header = ("LABEL,ID,TRACK_ID,QUALITY,POSITION_X,POSITION_Y,POSITION_Z,POSITION_T,FRAME\n"
                  "Label,Spot ID,Track ID,Quality,X,Y,Z,T,Frame\nLabel,Spot ID,Track ID,Quality,X,Y,Z,T,Frame\n"
                  ",,,(quality),(micron),(micron),(micron),(sec),\n")
        body_ = "".join(f"ID{n},{n},,1.0,{x:.4f},{y:.4f},{z:.4f},0.0,0\n" for n, (x, y, z) in enumerate(self.points))
        self.assertIn("lengths in um", self.read("spots.csv", header + body_))
        self.assertIn("lengths in mm", self.read("spots.csv", header.replace("micron", "mm") + body_))
        self.read("spots.csv", header.splitlines()[0] + "\n" + body_)

    def test_imaris_and_other_titles(self):
        rows_ = "".join(f"{x:.5f},{y:.5f},{z:.5f},um,Spot,Position,1,{n},\n" for n, (x, y, z) in enumerate(self.points))
        rule = self.read("a.csv", "\n\nPosition \n==================== \nPosition X,Position Y,Position Z,Unit,Category,Collection,Time,ID,\n" + rows_)
        self.assertIn("lengths in um", rule)
        self.assertIn("below 2 lines of title", rule)
        self.read("b.csv", "Exported 2024-03-01 by somebody\nx,y,z\n" + rows(self.points))
        self.read("c.txt", "Results of the day\n\nx y z\n" + rows(self.points, " "))

    def test_ptx(self):
        move = "0 1 0 0\n-1 0 0 0\n0 0 1 0\n10 20 30 1\n"  # PTX: row vectors times this matrix; last row: translation
        header = "{}\n{}\n10 20 30\n0 1 0\n-1 0 0\n0 0 1\n" + move
        scan = "".join(f"{y - 20:.5f} {10 - x:.5f} {z - 30:.5f} 0.5\n" for x, y, z in self.points)
        empty = "0 0 0 0.5\n" * 8
        for name in ("a.ptx", "a.txt"):
            with self.subTest(name):
                rule = self.read(name, header.format(6, 8) + scan + empty)
                self.assertIn("8 without an echo", rule)
        self.read("two.ptx", header.format(4, 10) + scan + header.format(6, 8) + scan + empty, np.concatenate([self.points] * 2))
        (self.folder / "short.ptx").write_text(header.format(6, 8) + scan)
        self.assertIn("expected 48 points of scan 1, got 40", self.refused("info", "short.ptx"))


class Units(TablesCase):
    def volume(self, image, text, *options):
        (self.folder / "marks.csv").write_text(text)
        return self.report("segment", image, "--points", "marks.csv", *options, "-o", "s.vdb")["surface"]["volume"]

    def test_units_of_the_header_become_the_images(self):
        image = self.write_image(origin=(100, -40, 20))
        world = self.points + (100, -40, 20)
        right = self.volume(image, "x,y,z\n" + rows(world))
        for header, scale in (("x (mm),y (mm),z (mm)", 1e-3), ("x [nm],y [nm],z [nm]", 1e3), ("X_um,Y_um,Z_um", 1),
                              ("Position X (\xb5m),Position Y (\xb5m),Position Z (\xb5m)", 1), ("x/m,y/m,z/m", 1e-6),
                              ("Centroid X mm,Centroid Y mm,Centroid Z mm", 1e-3)):
            with self.subTest(header):
                self.assertAlmostEqual(self.volume(image, header + "\n" + rows(world * scale, form="{:.9g}")), right, 2)
        mixed = world * (1, 1, 1e3)
        self.assertAlmostEqual(self.volume(image, "x (um),y (um),z (nm)\n" + rows(mixed, form="{:.9g}")), right, 2)

    def test_a_column_of_units(self):
        image = self.write_image(origin=(100, -40, 20))
        world = self.points + (100, -40, 20)
        right = self.volume(image, "x,y,z\n" + rows(world))
        text = "X,Y,Z,Unit\n" + "".join(f"{x / 1000:.9g},{y / 1000:.9g},{z / 1000:.9g},mm\n" for x, y, z in world)
        self.assertAlmostEqual(self.volume(image, text), right, 2)

    def test_a_given_scale_goes_first(self):
        image = self.write_image(origin=(100, -40, 20))
        world = self.points + (100, -40, 20)
        right = self.volume(image, "x,y,z\n" + rows(world))
        text = "x (m),y (m),z (m)\n" + rows(world / 1000, form="{:.9g}")
        self.assertAlmostEqual(self.volume(image, text, "--points-scale", 1000), right, 2)

    def test_the_scale_that_fits_is_proposed(self):
        image = self.write_image(origin=(100, -40, 20))
        world = self.points + (100, -40, 20)
        for scale in (1e3, 1e-3, 1e6, 1e-6, 100, 25.4):
            with self.subTest(scale=scale):
                (self.folder / "marks.csv").write_text("x,y,z\n" + rows(world / scale, form="{:.12g}"))
                message = self.refused("segment", image, "--points", "marks.csv", "-o", "s.vdb")
                self.assertIn(f"--points-scale {scale:g}", message)

    def test_voxels_inside_by_accident_are_doubted(self):
        image = self.write_image(spacing=(1, 1, 3))
        (self.folder / "voxels.csv").write_text("x,y,z\n" + rows(self.points))
        (self.folder / "world.csv").write_text("x,y,z\n" + rows(self.points * (1, 1, 3)))
        doubt = "--points-space index"
        self.assertIn(doubt, self.run_covol("segment", image, "--points", "voxels.csv", "-o", "s.vdb").stderr)
        self.assertNotIn(doubt, self.run_covol("segment", image, "--points", "world.csv", "-o", "s.vdb").stderr)
        self.assertNotIn(doubt, self.run_covol("segment", image, "--points", "voxels.csv", "--points-space", "index", "-o", "s.vdb").stderr)
        self.assertNotIn(doubt, self.run_covol("segment", image, "--points", "voxels.csv", "--points-space", "world", "-o", "s.vdb").stderr)


if __name__ == "__main__":
    unittest.main()
