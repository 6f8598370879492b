"""covol check FILE --for PROGRAM: each rule on a file to which it applies, and on one to which it does not.

    COVOL=build/bin/covol python3 -m unittest tests/cli/check_test.py
"""
import json
import subprocess
import unittest

from covol_case import COVOL
from interchange_test import MISSING, RADIUS, Folder, ball, np, sphere, tifffile


@unittest.skipIf(MISSING, MISSING)
class Programs(Folder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.image = cls.private / "i.tif"
        cls.run_covol("surface", "s.vdb:surface", "-o", "both.vdb", "--density", "both.vdb", "--compression", "none",
                      "--quiet")
        for end in "ply", "glb", "off", "obj", "stl":
            cls.run_covol("mesh", "s.vdb", "-o", f"m.{end}", "--quiet")
        for end in "seg.nrrd", "nrrd", "tif", "ome.tif", "npy":
            cls.run_covol("mask", "s.vdb", "--like", cls.image, "-o", f"x.{end}", "--quiet")

    def found(self, name, program):
        """[(severity, text and remedy)] of those findings that have a remedy, which come from the rules."""
        done = self.run_covol("check", name, "--for", program, "--json", "-", "--quiet",
                              code=self.code(name, program))
        report = json.loads(done.stdout)
        self.assertEqual(report["problems"] > 0, done.returncode == 3)
        return [(f["severity"], f["text"] + "; " + f["mend"]) for f in report["findings"] if "mend" in f]

    def code(self, name, program):
        code = subprocess.run([COVOL, "check", name, "--for", program], cwd=self.out, capture_output=True).returncode
        self.assertIn(code, (0, 3))
        return code

    def expect_finding(self, name, program, severity, *words):
        found = self.found(name, program)
        self.assertTrue(any(s == severity and all(word in text for word in words) for s, text in found),
                        (name, program, words, found))

    def silent(self, name, program, word):
        self.assertFalse([text for _, text in self.found(name, program) if word in text], (name, program, word))

    def test_blender(self):
        self.expect_finding("s.vdb", "blender", "problem", "not drawn", "--density")
        self.silent("both.vdb", "blender", "not drawn")
        self.expect_finding("s.vdb", "blender", "remark", "half a voxel along each axis, 0.25", "--mesh")
        self.expect_finding("s.vdb", "blender", "remark", "Blosc", "--compression none")
        self.silent("both.vdb", "blender", "Blosc")
        self.expect_finding("m.ply", "blender", "remark", "drops normals", "Shade Smooth")
        self.expect_finding("m.glb", "blender", "remark", "numpy")
        self.expect_finding("m.off", "blender", "problem", "no importer")
        self.expect_finding(self.image, "blender", "problem", "covol convert")
        for scale, word in ("1000", "clips"), ("0.001", "a dot"):
            self.run_covol("mesh", "s.vdb", "-o", "scaled.ply", "--unit-scale", scale, "--quiet")
            self.expect_finding("scaled.ply", "blender", "remark", word, "--unit-scale")
            self.silent("m.ply", "blender", word)

    def test_the_limits_of_size_are_the_same_without_a_program(self):
        """The clip end and the clip start of Blender's default view, 1,000 m and 0.01 m."""
        for size in (0.005, 0.02, 900, 1100):
            self.run_covol("mesh", "s.vdb", "-o", "sized.ply", "--unit-scale", size / (2 * RADIUS), "--quiet")
            expected = not 0.01 < size < 1000
            for more in ((), ("--for", "blender")):
                report = json.loads(self.run_covol("check", "sized.ply", *more, "--quiet", "--json", "-").stdout)
                self.assertEqual(any("units wide" in f["text"] for f in report["findings"]), expected, (size, more))

    def test_houdini(self):
        self.expect_finding("s.vdb", "houdini", "remark", "Blosc", "--compression none")
        self.silent("both.vdb", "houdini", "Blosc")
        self.expect_finding("s.vdb", "houdini", "remark", "on its back")
        self.expect_finding("m.ply", "houdini", "remark", "--up y")
        self.silent("m.glb", "houdini", "--up y")
        self.expect_finding(self.image, "houdini", "problem", "covol convert")

    def test_slicer(self):
        self.expect_finding("s.vdb", "slicer", "problem", ".seg.nrrd")
        self.expect_finding("m.glb", "slicer", "problem", ".glb")
        self.expect_finding("m.stl", "slicer", "remark", "LPS")
        self.expect_finding("m.ply", "slicer", "problem", "in um", "--unit-scale 0.001")
        self.silent("m.stl", "slicer", "--unit-scale")  # no finding: STL has no unit that could be wrong
        self.expect_finding("x.nrrd", "slicer", "remark", "in um")
        self.silent("x.seg.nrrd", "slicer", "Segment0_ID")
        (self.out / "bare.seg.nrrd").write_bytes((self.out / "x.nrrd").read_bytes())
        self.expect_finding("bare.seg.nrrd", "slicer", "problem", "Segment0_ID")
        self.expect_finding("x.tif", "slicer", "problem", "spacing nor origin")
        self.expect_finding("x.npy", "slicer", "problem", ".npy")
        header = ("\t\nics_version\t2.0\nlayout\torder\tbits\tx\ty\tz\nlayout\tsizes\t8\t8\t8\t8\nrepresentation\tformat\tinteger\n"
                  "representation\tsign\tunsigned\nrepresentation\tbyte_order\t1\nend\n")
        (self.out / "a.ics").write_bytes(header.encode() + bytes(range(256)) * 2)
        self.expect_finding("a.ics", "slicer", "problem", "does not open .ics", "write .nrrd")

    def test_fiji(self):
        self.expect_finding("s.vdb", "fiji", "problem", "covol mask")
        self.expect_finding("m.ply", "fiji", "problem", ".obj or .stl")
        self.silent("m.stl", "fiji", ".obj or .stl")
        self.silent("x.tif", "fiji", "black")
        tifffile.imwrite(self.out / "black.tif", np.uint8(ball() > 0.5), imagej=True, metadata={"axes": "ZYX"})
        self.expect_finding("black.tif", "fiji", "problem", "min and max")
        self.expect_finding("black.tif", "fiji", "remark", "no unit")
        self.silent(self.image, "fiji", "no unit")
        self.silent(self.image, "fiji", "min and max")
        self.expect_finding("x.ome.tif", "fiji", "remark", "Bio-Formats")
        tifffile.imwrite(self.out / "big.tif", np.uint8(200 * ball()), bigtiff=True)
        self.expect_finding("big.tif", "fiji", "remark", "BigTIFF")
        self.silent("x.tif", "fiji", "BigTIFF")
        self.expect_finding("x.npy", "fiji", "problem", ".npy")
        turned = "\n".join(["NRRD0004", "type: uint8", "dimension: 3", "sizes: 8 8 8", "encoding: raw",
                            "space: left-posterior-superior", "space origin: (0,0,0)",
                            "space directions: (0.8,0.6,0) (-0.6,0.8,0) (0,0,1)", "", ""])
        (self.out / "turned.nrrd").write_bytes(turned.encode() + bytes(range(256)) * 2)
        self.expect_finding("turned.nrrd", "fiji", "remark", "rotation of the image", "--points-space index")
        self.silent("x.nrrd", "fiji", "rotation")

    def test_print(self):
        self.expect_finding("s.vdb", "print", "problem", "covol mesh")
        self.expect_finding("m.ply", "print", "problem", "in um", "--unit-scale 0.001")
        self.expect_finding("m.stl", "print", "remark", "no unit")
        self.silent("m.stl", "print", "open")
        self.silent("m.stl", "print", "thin")
        vertices, faces = self.mesh_of(sphere(400, (0, 0, 0), 10))
        self.write_off("open.off", vertices, faces[:-5])
        self.expect_finding("open.off", "print", "problem", "open", "--repair")
        self.write_off("crossing.off", np.r_[vertices, vertices + (5, 0, 0)], np.r_[faces, faces + len(vertices)])
        self.expect_finding("crossing.off", "print", "problem", "intersect each other", "--repair")
        # A shell 0.2 mm thick between two spheres; the triangles of the inner sphere are reversed, so that they face
        # its cavity.
        shell = np.r_[vertices, 0.98 * vertices], np.r_[faces, faces[:, ::-1] + len(vertices)]
        self.write_off("shell.off", *shell)
        self.expect_finding("shell.off", "print", "remark", "mm thin in places", "--isovalue")
        self.write_off("thick.off", np.r_[vertices, 0.9 * vertices], shell[1])
        self.silent("thick.off", "print", "thin")
        self.write_off("huge.off", 100 * vertices, faces)
        self.expect_finding("huge.off", "print", "remark", "mm wide", "--unit-scale 0.05")
        self.silent("thick.off", "print", "mm wide")

    def mesh_of(self, points):
        self.out.joinpath("c.xyz").write_text("\n".join("%g %g %g" % tuple(p) for p in points))
        self.run_covol("reconstruct", "c.xyz", "-o", "c.off", "--quiet")
        lines = [line for line in (self.out / "c.off").read_text().split("\n") if not line.startswith("#")]
        count = [int(n) for n in lines[1].split()]
        vertices = np.array([line.split() for line in lines[2:2 + count[0]]], float)
        return vertices, np.array([line.split()[1:] for line in lines[2 + count[0]:2 + count[0] + count[1]]], int)

    def write_off(self, name, vertices, faces):
        with open(self.out / name, "w") as file:
            file.write(f"OFF\n{len(vertices)} {len(faces)} 0\n")
            np.savetxt(file, vertices, "%.9g")
            np.savetxt(file, np.c_[np.full(len(faces), 3), faces], "%d")

    def test_words(self):
        self.assertIn("blender", self.run_covol("check", "s.vdb", "--for", "maya", code=2).stderr)
        plain = self.run_covol("check", "s.vdb").stdout
        self.assertIn("--density", plain)
        self.assertNotIn("half a voxel", plain)


if __name__ == "__main__":
    unittest.main()
