"""The macro for ImageJ and Fiji: marks as a user sets them there, and the results, in Debian's ImageJ on a virtual screen.

    COVOL=build/bin/covol python3 -m unittest tests/cli/imagej_test.py
"""
import csv
import math
import shutil
import struct
import subprocess
import unittest
from pathlib import Path

from interchange_test import CENTRE, COVOL, MISSING, RADIUS, Folder, np, tifffile

MACRO = Path(__file__).resolve().parents[2] / "tools/imagej/Covol_.ijm"
JAR = Path("/usr/share/java/ij.jar")
PROGRAMS = [name for name in ("java", "xvfb-run") if not shutil.which(name)]
SETUP = '''open("%(image)s");
%(marks)s
said = runMacro("%(macro)s", "%(settings)s");
File.saveString(said, "%(out)s/said.txt");
if (said != "") exec("sh", "-c", "kill $PPID");
text = "";
for (i = 0; i < Overlay.size; i++) {
    Overlay.activateSelection(i);
    getStatistics(area);
    Roi.getPosition(c, z, t);
    text = text + z + "," + area + "\\n";
}
run("Select None");
File.saveString("title=" + getTitle() + "\\n" + text, "%(out)s/overlay.txt");
selectImage("Mask of " + getTitle());
saveAs("Tiff", "%(out)s/back.tif");
selectWindow("covol: %(title)s");
saveAs("Results", "%(out)s/table.csv");
'''


def roi_of_points(points):
    """A multi-point selection as ImageJ saves it, of (x, y, slice from 1): points on several slices."""
    n = len(points)
    head, head2 = bytearray(64), bytearray(64)
    struct.pack_into(">4shBB", head, 0, b"Iout", 228, 10, 0)
    struct.pack_into(">H", head, 16, n)
    struct.pack_into(">h", head, 50, 128)  # option SUB_PIXEL_RESOLUTION: coordinates follow as floats, too
    struct.pack_into(">i", head, 60, 64 + 12 * n)
    struct.pack_into(">i", head2, 48, 64 + 12 * n + 64)
    x, y, z = zip(*points)
    return (bytes(head) + struct.pack(f">{2 * n}h", *map(int, x), *map(int, y)) + struct.pack(f">{2 * n}f", *x, *y) + bytes(head2) +
            struct.pack(f">{n}i", *(slice << 8 for slice in z)))


@unittest.skipIf(MISSING, MISSING)
@unittest.skipIf(PROGRAMS or not JAR.exists(), "SKIPPED: ImageJ is not there (apt-get install imagej xvfb xauth)")
class Macro(Folder):
    def java(self, text):
        """Runs a macro as from ImageJ's menu: in batch mode, a macro does not have access to the ROI Manager of another one."""
        (self.out / "test.ijm").write_text(text + 'exec("sh", "-c", "kill $PPID");')
        self.temporary.mkdir(exist_ok=True)
        return subprocess.run(["xvfb-run", "-a", "java", "-Xmx1g", f"-Duser.home={self.out}", f"-Djava.io.tmpdir={self.temporary}", "-cp", JAR, "ij.ImageJ", "-macro",
                               self.out / "test.ijm"], capture_output=True, text=True, timeout=90, cwd=self.out)

    @property
    def temporary(self):
        """The folder that ImageJ uses for temporary files: no other program's files are there."""
        return self.out / "temporary"

    def assert_nothing_is_left(self):
        self.assertEqual([entry.name for entry in self.temporary.glob("covol-*")], [])

    def imagej(self, marks, settings="", title="i.tif"):
        """Runs the macro. @return (mask, [(slice, area of its outline)], the table's row)"""
        for name in ("overlay.txt", "back.tif", "table.csv"):
            (self.out / name).unlink(missing_ok=True)
        output = self.java(SETUP % {"image": self.private / "i.tif", "marks": marks, "macro": MACRO, "out": self.out, "title": title,
                                  "settings": "program=" + str(Path(COVOL).resolve()) + settings})
        self.assertTrue((self.out / "back.tif").exists(), (self.out / "said.txt").read_text() + output.stdout + output.stderr)
        name, *rows = (self.out / "overlay.txt").read_text().splitlines()
        self.assertEqual(name, "title=" + title)
        with open(self.out / "table.csv", newline="") as file:
            table = next(csv.DictReader(file))
        return tifffile.imread(self.out / "back.tif"), [tuple(map(float, row.split(","))) for row in rows], table

    def rings(self):
        """(slice from 1, x, y) of rings around the ball, in pixels, and of its poles."""
        geometry = self.report("info", self.private / "i.tif")["image"]
        middle = (np.array(CENTRE) - geometry["origin"]) / geometry["spacing"]
        radius = RADIUS / np.array(geometry["spacing"])
        turns = np.linspace(0, 2 * np.pi, 16, endpoint=False)
        rings = []
        for z in range(math.ceil(middle[2] - radius[2]), math.floor(middle[2] + radius[2]) + 1):
            part = math.sqrt(max(0, 1 - ((z - middle[2]) / radius[2])**2))
            rings.append((z + 1, middle[0] + part * radius[0] * np.cos(turns), middle[1] + part * radius[1] * np.sin(turns)))
        return rings

    def multi_point(self):
        """A macro that opens the rings as one multi-point selection."""
        points = [(x, y, z) for z, xs, ys in self.rings() for x, y in zip(xs, ys)]
        (self.out / "points.roi").write_bytes(roi_of_points(points))
        return f'open("{self.out}/points.roi");'

    def expect_the_ball(self, found):
        mask, outlines, table = found
        self.run_covol(*self.job, "-o", "s.vdb", "--mask", "s.nrrd")
        # The mask saved by ImageJ has the origin of the stack, so that covol compares the two masks in world
        # coordinates.
        compared = self.report("compare", "back.tif", "s.nrrd")["compare"]
        self.assertGreater(compared["dice"], 0.97)
        full = [k for k in range(len(mask)) if mask[k].any()]
        self.assertEqual([int(z) for z, _ in outlines], [k + 1 for k in full])
        pixel = np.prod(self.report("info", self.private / "i.tif")["image"]["spacing"][:2])
        for z, area in outlines:
            self.assertAlmostEqual(area, np.count_nonzero(mask[int(z) - 1]) * pixel, delta=1e-3 * area)
        [volume] = (float(value) for name, value in table.items() if name.startswith("volume"))
        self.assertAlmostEqual(volume / compared["volume_b"], 1, delta=0.05)

    def test_a_multi_point(self):
        self.expect_the_ball(self.imagej(self.multi_point()))

    def test_outlines_and_points_in_the_roi_manager(self):
        marks, (first, *between, last) = "", self.rings()
        for z, xs, ys in between[::2]:  # + 0.5: ImageJ's area selections count from pixel corners
            x, y = (", ".join(f"{v + 0.5:.2f}" for v in values) for values in (xs, ys))
            marks += f'setSlice({z}); makeSelection("polygon", newArray({x}), newArray({y})); roiManager("add");\n'
        for z, xs, ys in (first, last):
            marks += f'setSlice({z}); makePoint({xs.mean():.2f}, {ys.mean():.2f}, "small"); roiManager("add");\n'
        self.expect_the_ball(self.imagej(marks))

    def test_settings(self):
        page = self.out / "it's a page.html"
        self.imagej(self.multi_point(), f"\\nvoxel size=2vx\\noptions=--rho 0.5 --quiet\\nreport={page}")
        self.assertGreater(page.stat().st_size, 100_000)
        self.assert_nothing_is_left()

    def test_what_is_wrong_is_returned(self):
        program = Path(COVOL).resolve()
        stack = f'open("{self.private / "i.tif"}"); '
        cases = [("", "program=covol", "open a stack first"), (stack, "program=covol", "set marks on the border first"),
                 (stack + "makePoint(5, 5); ", "program=/nowhere/covol", "/nowhere/covol"),
                 (stack + "makePoint(5, 5); ", f"program={program}\\noptions=--no-such-option", "--no-such-option")]
        text = ""
        for n, (begin, settings, _) in enumerate(cases):
            text += f'{begin}said = runMacro("{MACRO}", "{settings}"); File.saveString(said, "{self.out}/said{n}.txt"); close("*");\n'
        done = self.java(text)
        for n, (_, _, expected_text) in enumerate(cases):
            self.assertIn(expected_text, (self.out / f"said{n}.txt").read_text(), done.stdout + done.stderr)
        self.assert_nothing_is_left()


if __name__ == "__main__":
    unittest.main()
