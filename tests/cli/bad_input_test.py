"""Wrong input of the real program: one line with the reason, the exit code, and no file. Standard library only.

    COVOL=build/bin/covol python3 -m unittest tests/cli/bad_input_test.py
"""
import json
import os
import shutil
import struct
import subprocess
import unittest

from covol_case import CENTER, COVOL, Case, write_nrrd, write_xyz


class BadInput(Case):
    def test_missing_files(self):
        self.refuse("segment", "none.nrrd", "--points", self.points, "-o", "s.vdb", code=4, expected_text="none.nrrd")
        self.refuse("segment", self.image, "--points", "none.xyz", "-o", "s.vdb", code=4, expected_text="none.xyz")
        self.refuse("reconstruct", "none.ply", "-o", "s.vdb", code=4, expected_text="none.ply")
        for command in ("surface", "mesh"):
            self.refuse(command, "none.vdb", "-o", "s.vdb" if command == "surface" else "s.ply", code=4, expected_text="none.vdb")

    def test_bad_points(self):
        bad = self.inputs / "bad.xyz"
        bad.write_text("1 2 3\n1 two 3\n")
        self.refuse("segment", self.image, "--points", bad, "-o", "s.vdb", code=3, expected_text="bad.xyz:2")
        bad.write_text("1 2 3\n1 nan 3\n")
        self.refuse("segment", self.image, "--points", bad, "-o", "s.vdb", code=3, expected_text="bad.xyz:2")
        bad.write_text("")
        self.refuse("segment", self.image, "--points", bad, "-o", "s.vdb", code=3, expected_text="bad.xyz")

    def test_points_outside_the_image(self):
        far = self.inputs / "far.xyz"
        write_xyz(far, [(1000, 0, 0), CENTER])
        self.refuse("segment", self.image, "--points", far, "-o", "s.vdb", code=3, expected_text="1 of 2")

    def test_bad_images(self):
        bad = self.inputs / "bad.nrrd"
        write_nrrd(bad, (8, 8), bytes(64))
        self.refuse("segment", bad, "--points", self.points, "-o", "s.vdb", code=3)
        write_nrrd(bad, (8, 0, 8), b"")
        self.refuse("segment", bad, "--points", self.points, "-o", "s.vdb", code=3)
        bad.write_bytes(self.image.read_bytes()[:1000])
        self.refuse("segment", bad, "--points", self.points, "-o", "s.vdb", code=3, expected_text="bad.nrrd")
        bad.write_bytes(b"")
        self.refuse("segment", bad, "--points", self.points, "-o", "s.vdb", code=3, expected_text="bad.nrrd")
        write_nrrd(bad, (8, 8, 8), struct.pack("<512f", *([float("nan")] * 512)), kind="float")
        self.refuse("segment", bad, "--init", "sphere:3,-2,1,2", "-o", "s.vdb", code=3)

    def test_options_out_of_range(self):
        for flag, value in [("--theta", "2"), ("--rho", "-0.5"), ("--tau", "0"), ("--delta", "-1"), ("--epsilon", "0"),
                            ("--voxel-size", "0"), ("--tag-distance", "0"), ("--image-yields", "3"), ("--edge-k", "-1"), ("--edge-contrast", "0"), ("--threads", "-1"),
                            ("--max-steps", "-1"), ("--unit-scale", "0"), ("--delta", "nan"), ("--theta", "nan"),
                            ("--roi", "0,0,0,0,1,1"), ("--init", "sphere:0,0,0,-1"), ("--spacing", "0,1,1")]:
            with self.subTest(flag=flag, value=value):
                self.refuse("segment", self.image, "--points", self.points, "-o", "s.vdb", flag, value, code=3)

    def test_empty_values(self):
        for flag in ("--theta", "--rho", "--delta", "--tolerance", "--guess-weight", "--mask", "--init"):
            with self.subTest(flag=flag):
                self.refuse("segment", self.image, "--points", self.points, "-o", "s.vdb", flag, "", code=2, expected_text=flag)
        self.refuse("segment", self.image, "--points", self.points, "-o", "", code=2, expected_text="--output")

    def test_numbers_far_out_of_range(self):
        for flag, value, code in [("--image-yields", "-1", 3), ("--guess-weight", "-1", 3), ("--threads", "100000", 3),
                                  ("--tag-distance", "1e308", 3), ("--tag-distance", "1000vx", 3), ("--tau", "inf", 3),
                                  ("--max-steps", "99999999999999", 2), ("--memory-limit", "0", 3),
                                  ("--voxel-size", "1e-300", 3), ("--roi", "100,100,100,200,200,200", 3)]:
            with self.subTest(flag=flag, value=value):
                self.refuse("segment", self.image, "--points", self.points, "-o", "s.vdb", flag, value, code=code)

    def test_inputs_are_not_outputs(self):
        image, points = self.inputs / "keep.nrrd", self.inputs / "keep.xyz"
        shutil.copy(self.image, image)
        shutil.copy(self.sparse, points)
        level_set = self.inputs / "keep.vdb"
        self.run_covol("segment", image, "--points", points, "-o", level_set)
        link = self.inputs / "link.nrrd"
        link.symlink_to(image)
        before = {p: p.read_bytes() for p in (image, points, level_set)}
        for args in [("segment", image, "--points", points, "-o", "s.vdb", "--mask", image),
                     ("segment", image, "--points", points, "-o", "s.vdb", "--mask", link),
                     ("segment", image, "--points", f"a={points}", "-o", "s.vdb", "--json", points),
                     ("segment", image, "--points", points, "-o", "s.vdb", "--save-config", points),
                     ("segment", image, "--init", f"vdb:{level_set}", "-o", level_set),
                     ("reconstruct", points, "-o", "s.vdb", "--json", points),
                     ("mask", level_set, "--like", image, "-o", image),
                     ("surface", level_set, "-o", level_set),
                     ("convert", points, points)]:
            with self.subTest(args=args):
                self.refuse(*args, code=3, expected_text="is an input of this run")
        for path, data in before.items():
            self.assertEqual(path.read_bytes(), data)

    def test_outputs_that_are_no_files(self):
        pipe = self.inputs / "pipe.vdb"
        os.mkfifo(pipe)
        self.refuse("segment", self.image, "--points", self.points, "-o", pipe, code=4, expected_text="not a regular file")
        # Reports, unlike .vdb files, can be written to devices and pipes.
        done = self.segment("--quiet", "--json", "/dev/stdout", points=self.sparse)
        self.assertEqual(json.loads(done.stdout)["command"], "segment")
        (self.out / "s.vdb").unlink()
        if os.path.exists("/dev/full"):
            self.refuse("segment", self.image, "--points", self.sparse, "-o", "s.vdb", "--json", "/dev/full", code=4,
                        expected_text="/dev/full")

    def test_files_that_are_not_what_they_should_be(self):
        folder, empty = self.inputs / "folder.nrrd", self.inputs / "empty.vdb"
        folder.mkdir(exist_ok=True)
        empty.write_bytes(b"")
        cut = self.inputs / "cut.vdb"
        self.run_covol("segment", self.image, "--points", self.sparse, "-o", cut)
        cut.write_bytes(cut.read_bytes()[:-100])
        self.assertIn(self.refused("segment", folder, "--points", self.points, "-o", "s.vdb"), (3, 4))
        self.assertIn(self.refused("segment", self.points, "--points", self.image, "-o", "s.vdb"), (3,))
        for vdb in (empty, cut, self.points):
            for args in [("mesh", vdb, "-o", "m.ply"), ("mask", vdb, "--like", self.image, "-o", "m.nrrd"),
                         ("render", vdb, "-o", "p.png"), ("info", vdb) if vdb != self.points else ("surface", vdb, "-o", "s.vdb"),
                         ("segment", self.image, "--init", f"vdb:{vdb}", "-o", "s.vdb")]:
                with self.subTest(args=args):
                    self.assertIn(self.refused(*args), (3, 4))

    def refused(self, *args):
        """The exit code of a run that must fail with one line and no file."""
        done = subprocess.run([COVOL, *map(str, args), "--quiet"], capture_output=True, text=True, cwd=self.out, timeout=60)
        self.assertRegex(done.stderr, r"^covol: error: [^\n]+\n$")
        self.assertEqual(self.files(), [])
        return done.returncode

    def test_fog_is_no_level_set(self):
        solid = self.inputs / "solid.vdb"
        fog = self.inputs / "fog.vdb"
        self.run_covol("segment", self.image, "--points", self.sparse, "-o", solid, "--density", fog)
        for args in [("mesh", fog, "-o", "m.ply"), ("mask", fog, "--like", self.image, "-o", "m.nrrd"),
                     ("render", fog, "-o", "p.png")]:
            self.refuse(*args, code=3, expected_text="got a fog volume")
        self.refuse("mesh", solid, "-o", "m.ply", "--min-component", "1000vx", code=3, expected_text="use a smaller --min-component")

    def test_tag_start_without_points(self):
        self.refuse("segment", self.image, "-o", "s.vdb", code=3, expected_text="points")

    def test_outputs_are_checked_first(self):
        # The image does not exist, but the message must be about the output, because outputs are checked before inputs.
        for flags, code in [(["-o", "s.abc"], 3), (["-o", "no/folder/s.vdb"], 4),
                            (["-o", "s.vdb", "--mask", "m.jpg"], 3), (["-o", "s.vdb", "--mesh", "m.xyz"], 3),
                            (["-o", "s.vdb", "--json", "no/folder/r.json"], 4),
                            (["-o", "s.vdb", "--density", "./s.vdb"], 3)]:
            with self.subTest(flags=flags):
                line = self.refuse("segment", "none.nrrd", *flags, code=code)
                self.assertNotIn("none.nrrd", line)

    def test_output_that_is_a_folder(self):
        folder = self.inputs / "folder.vdb"
        folder.mkdir()
        self.refuse("segment", self.image, "--points", self.points, "-o", folder, code=4, expected_text="folder")


if __name__ == "__main__":
    unittest.main()
