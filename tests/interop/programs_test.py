"""ImageJ, MeshLab and CloudCompare open the files that covol writes, and agree on position, size and orientation.

    COVOL=build/bin/covol python3 -m unittest tests/interop/programs_test.py

Each test is skipped if its program, or xvfb-run, is not installed (tests/run.sh installs them). VTK (whose readers ParaView uses),
meshio, nibabel and tifffile are tested in tests/cli/readers_test.py, Blender in tests/cli/blender_test.py.
"""
import math
import pathlib
import re
import shutil
import subprocess
import sys
import unittest

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent / "cli"), str(HERE.parent / "property")]
import covol_case  # noqa: E402

try:
    import numpy as np
    import tifffile
    import lattice_files as files
    from lattice_body import AXES, CENTRE, RADII, SIZE, image, indices, level, write_body
    MISSING = ""
except ImportError as error:
    MISSING = f"SKIPPED: {error}; see tests/install_packages.sh"

IMAGEJ = pathlib.Path("/usr/share/java/ij.jar")
DISPLAY = shutil.which("xvfb-run")  # runs the programs on a virtual screen, as they need one


def needs(program, package):
    found = program.exists() if isinstance(program, pathlib.Path) else shutil.which(program)
    return unittest.skipUnless(DISPLAY and found, f"SKIPPED: {package} or xvfb is not installed (apt-get install {package} xvfb xauth)")


@unittest.skipIf(MISSING, MISSING)
class Programs(covol_case.Case):
    """A rotated ellipsoid as a level set, on the lattice of an image."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.lattice = files.Lattice(np.diag([0.5, 0.25, 0.75]), np.array([30.0, -20.0, 7.5]), "um")
        cls.body, cls.stack = cls.inputs / "body.vdb", cls.inputs / "stack.tif"
        write_body(cls.body, cls.lattice)
        files.write_imagej(cls.stack, image(), cls.lattice)

    def run_program(self, *words):
        done = subprocess.run([DISPLAY, "-a", *map(str, words)], cwd=self.out, capture_output=True, text=True, timeout=120)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return done.stdout

    def mesh_files(self, *ends):
        for end in ends:
            self.run_covol("mesh", self.body, "-o", f"mesh.{end}", "--quiet")
            yield f"mesh.{end}"

    def volume(self):
        return 4 / 3 * math.pi * RADII.prod() * abs(np.linalg.det(self.lattice.steps))

    def covariance(self):
        """Random positions within the body."""
        axes = self.lattice.steps @ AXES
        return axes @ np.diag(RADII ** 2 / 5) @ axes.T


class ImageJ(Programs):
    MACRO = """
        open(getArgument());
        getVoxelSize(w, h, d, unit);
        print(unit, w, h, d, nSlices, getWidth(), getHeight(), bitDepth());
        run("Set Measurements...", "mean center redirect=None decimal=9");
        for (s = 1; s <= nSlices; s++) {
            setSlice(s);
            List.setMeasurements;
            print(List.getValue("Mean"), List.getValue("XM"), List.getValue("YM"));
        }
    """

    def imagej(self, macro, argument):
        (self.out / "macro.ijm").write_text(macro)
        lines = self.run_program("java", "-cp", IMAGEJ, "ij.ImageJ", "-batch", self.out / "macro.ijm", argument).splitlines()
        return [line.split() for line in lines if line.strip()]

    @needs(IMAGEJ, "imagej")
    def test_masks(self):
        """For each slice: the area inside, and its centre in calibrated units."""
        levels = level(indices())
        for name in ("mask.tif", "mask.ome.tif"):
            with self.subTest(name):
                self.run_covol("mask", self.body, "--like", self.stack, "-o", name, "--quiet")
                inside = tifffile.imread(self.out / name) > 0
                self.assertTrue((inside == (levels < 0))[np.abs(levels) > 0.1].all())
                reported, *slices = self.imagej(self.MACRO, self.out / name)
                unit, numbers = reported[0], reported[-7:]  # numbers from the end: ImageJ may print no unit
                if name == "mask.tif":  # ImageJ without plugins ignores the unit and spacing in OME-XML
                    self.assertIn(unit, ("µm", "um", "micron"))
                    np.testing.assert_allclose([float(n) for n in numbers[:3]], self.lattice.spacing, rtol=1e-6)
                self.assertEqual([int(n) for n in numbers[3:6]], [SIZE[2], SIZE[0], SIZE[1]])
                self.assertEqual(len(slices), SIZE[2])
                for k, (mean, x, y) in enumerate(slices):
                    count = inside[k].sum()
                    self.assertAlmostEqual(float(mean), count / inside[k].size, places=6)
                    if count and name == "mask.tif":
                        j, i = np.argwhere(inside[k]).mean(0)
                        place = self.lattice.world((i, j, k))[:2] + 0.5 * self.lattice.spacing[:2]  # ImageJ counts from pixel corners
                        np.testing.assert_allclose([float(x), float(y)], place, atol=0.01 * self.lattice.spacing.min())

    @needs(IMAGEJ, "imagej")
    def test_suggested_places(self):
        """Suggestions for a body whose upper half has neither marks nor edges."""
        half = (level(indices()) < 0) & (indices()[..., 2] < CENTRE[2])
        files.write_imagej(self.out / "half.tif", np.where(half, 200, 20).astype(np.uint8), self.lattice)
        angles = np.random.default_rng(1).normal(size=(300, 3))
        places = angles / np.linalg.norm(angles, axis=1)[:, None] * RADII @ AXES.T + CENTRE
        np.savetxt(self.out / "marks.xyz", self.lattice.world(places[places[:, 2] < CENTRE[2] + 0.5]), "%.6f")
        report = self.report("segment", self.out / "half.tif", "--points", "marks.xyz", "--rho", 0, "-o", "s.vdb", "--suggest", 2,
                             "--suggestions", "places.roi")
        suggested = report["evidence"]["suggestions"]
        self.assertGreater(len(suggested), 0)
        macro = """
            files = split(getArgument(), "|");
            open(files[0]);
            open(files[1]);
            run("Set Measurements...", "stack redirect=None decimal=9");
            run("Measure");
            getSelectionCoordinates(x, y);
            for (n = 0; n < nResults; n++) print(x[n], y[n], getResult("Slice", n));
        """
        # The last lines are those of the macro; ImageJ prints its results table before them.
        rows = self.imagej(macro, f"{self.stack}|{self.out / 'places.roi'}")[-len(suggested):]
        self.assertEqual(len(rows), len(suggested), rows)
        for row, place in zip(rows, suggested):
            x, y, slice_ = map(float, row)
            np.testing.assert_allclose([x, y], place["index"][:2], atol=1e-3)
            self.assertEqual(int(slice_), round(place["index"][2]) + 1)


class MeshLab(Programs):
    @needs("meshlabserver", "meshlab")
    def test_meshes(self):
        (self.out / "measure.mlx").write_text('<!DOCTYPE FilterScript>\n<FilterScript><filter name="Compute Geometric Measures"/></FilterScript>\n')
        covariance = self.covariance()
        inertia = self.volume() * (np.trace(covariance) * np.eye(3) - covariance)
        for name in self.mesh_files("ply", "stl", "off"):  # no OBJ: Debian's MeshLab fails an assertion with any
            with self.subTest(name):
                reported = self.run_program("meshlabserver", "-i", name, "-s", "measure.mlx")
                number = r"\s*(-?[\d.]+)"
                volume = float(re.search("Mesh Volume  is" + number, reported).group(1))
                self.assertAlmostEqual(volume / self.volume(), 1, delta=0.01)
                centre = [float(v) for v in re.search("Center of Mass  is" + 3 * number, reported).groups()]
                np.testing.assert_allclose(centre, self.lattice.world(CENTRE), atol=0.02 * self.lattice.spacing.min())
                rows = re.findall(r"\|" + 3 * number + r" \|", reported.split("Inertia Tensor is")[1])[:3]
                np.testing.assert_allclose(np.array(rows, float), inertia, atol=0.02 * np.abs(inertia).max())


class CloudCompare(Programs):
    @needs("CloudCompare", "cloudcompare")
    def test_meshes(self):
        for name in self.mesh_files("ply", "obj", "stl", "off"):
            with self.subTest(name):
                (self.out / "volume.txt").unlink(missing_ok=True)
                self.run_program("CloudCompare", "-SILENT", "-AUTO_SAVE", "OFF", "-C_EXPORT_FMT", "ASC", "-PREC", 9, "-O", name,
                                 "-MESH_VOLUME", "-TO_FILE", "volume.txt", "-EXTRACT_VERTICES", "-SAVE_CLOUDS", "FILE", "vertices.asc")
                volume = float(re.search(r"V = ([\d.]+)", (self.out / "volume.txt").read_text()).group(1))
                self.assertAlmostEqual(volume / self.volume(), 1, delta=0.01)
                vertices = np.loadtxt(self.out / "vertices.asc", usecols=(0, 1, 2))
                off = level(self.lattice.index(vertices))
                self.assertLess(np.abs(off).max(), 0.1)


if __name__ == "__main__":
    unittest.main()
