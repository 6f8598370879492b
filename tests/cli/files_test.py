"""Files around a run: which leftovers are removed, where outputs are written, and which files must not be replaced.

    COVOL=build/bin/covol COVOL_KILL_AT=build/tests/libcovol_kill_at.so python3 -m unittest tests/cli/files_test.py
"""
import hashlib
import math
import os
import pathlib
import signal
import stat
import subprocess
import unittest

import numpy as np

import image_formats_case as formats
from covol_case import ORIGIN, SIZE, H, ball_bytes
from files_case import LINE, PHANTOM, PROGRAM, Files


class Cleared(Files):
    def test_folders_of_the_user_stay(self):
        for name in ".covol-notes", ".covol-abcdef", ".covol-cache.d", ".covol-":
            (self.out / name).mkdir()
            (self.out / name / "diary.txt").write_text("important")
        (self.out / ".covol-linked").symlink_to(self.inputs)
        inputs = sorted(self.inputs.iterdir())
        self.run_covol(*PHANTOM, "-o", "x.nrrd")
        self.run_covol(*PHANTOM, "-o", "x.zarr")
        self.assertEqual(self.hidden(), [".covol-", ".covol-abcdef", ".covol-cache.d", ".covol-linked", ".covol-notes"])
        for name in ".covol-notes", ".covol-abcdef", ".covol-cache.d", ".covol-":
            self.assertEqual(self.text(name + "/diary.txt"), "important")
        self.assertEqual(sorted(self.inputs.iterdir()), inputs)

    def test_what_a_killed_run_left_goes(self):
        run = self.start("segment", self.image, *LINE, "-o", "s.vdb", "--mesh", "s.ply", "--mask", "s.zarr")
        while run.poll() is None and not any(self.out.glob(".covol-*/*")):
            pass
        run.kill()
        run.communicate()
        self.run_covol(*PHANTOM, "-o", "x.nrrd")
        self.assertEqual(self.hidden(), [])


@unittest.skipUnless("COVOL_KILL_AT" in os.environ, "COVOL_KILL_AT, the library that kills, is not set")
class TwoFolders(Files):
    OUTPUTS = {"-o": "a/x.nrrd", "--points": "b/p.xyz", "--labels": "c/l.zarr"}

    def command(self, size):
        return [PROGRAM, "phantom", "sphere", "--size", str(size), "--quiet",
                *(word for flag, name in self.OUTPUTS.items() for word in (flag, name))]

    def state(self):
        """Digests of the outputs, one for each folder."""
        states = []
        for name in self.OUTPUTS.values():
            path = self.out / name
            digest = hashlib.sha256()
            for file in sorted(path.rglob("*")) if path.is_dir() else [path]:
                if file.is_file():
                    digest.update(str(file.relative_to(self.out)).encode() + b"\0" + file.read_bytes())
            states.append(digest.hexdigest())
        return states

    def test_killed_at_any_call_all_folders_are_old_or_new(self):
        for folder in "abc":
            (self.out / folder).mkdir()
        sets = []
        for size in 16, 18:
            subprocess.run(self.command(size), cwd=self.out, check=True)
            sets.append(self.state())
        self.assertTrue(all(one != other for one, other in zip(*sets)))
        new = old = 0
        for call in range(1, 300):
            last = sets.index(self.state())
            environment = {**os.environ, "LD_PRELOAD": os.environ["COVOL_KILL_AT"], "KILL_AT": str(call)}
            code = subprocess.run(self.command((18, 16)[last]), cwd=self.out, env=environment).returncode
            if code == 0:
                break
            self.assertEqual(code, -signal.SIGKILL)
            # A run that writes to one of the folders completes or discards the interrupted set of outputs in all of
            # them.
            self.run_covol(*PHANTOM, "-o", "abc"[call % 3] + "/next.nrrd")
            self.assertIn(self.state(), sets, f"killed before call {call}")
            new += sets.index(self.state()) != last
            old += sets.index(self.state()) == last
            for folder in "abc":
                self.run_covol(*PHANTOM, "-o", folder + "/next.nrrd")
                self.assertEqual(self.hidden(folder), [])
            self.assertIn(self.state(), sets)
        self.assertEqual(code, 0)
        self.assertGreater(new, 5)
        self.assertGreater(old, 5)


class Places(Files):
    def image_of(self, name, header):
        """A ball whose pixels are in a separate file."""
        (self.out / name).write_text(header)
        self.report("info", name)

    def meta(self, data, size=SIZE):
        origin = " ".join(map(str, ORIGIN))
        return (f"NDims = 3\nDimSize = {SIZE} {SIZE} {size}\nElementSpacing = {H} {H} {H}\nOffset = {origin}\n"
                f"ElementType = MET_UCHAR\nElementDataFile = {data}\n")

    def nrrd(self, data):
        return (f"NRRD0004\ntype: uint8\ndimension: 3\nspace: left-posterior-superior\nsizes: {SIZE} {SIZE} {SIZE}\n"
                f"space directions: ({H},0,0) (0,{H},0) (0,0,{H})\nspace origin: ({','.join(map(str, ORIGIN))})\n"
                f"encoding: raw\ndata file: {data}\n")

    def keeps(self, image, *files):
        """No output of any kind may replace one of the files, whatever name is used for it."""
        before = {name: self.bytes(name) for name in files}
        (self.out / "links").mkdir()
        for name in files:
            link = "links/l" + "".join(pathlib.Path(name).suffixes)
            (self.out / link).symlink_to(self.out / name)
            for path in name, "./links/../" + name, link:
                for flag in "--mask", "--json":
                    if flag == "--mask" and not name.endswith((".npy", ".nrrd", ".tif", ".mha", ".nii.gz")):
                        continue
                    self.fails("segment", image, *LINE, "-o", "s.vdb", flag, path, code=3, expected_text="of this run")
            (self.out / link).unlink()
        (self.out / "links").rmdir()
        self.assertEqual({name: self.bytes(name) for name in files}, before)
        self.assertFalse((self.out / "s.vdb").exists())

    def test_pixels_in_files_of_their_own(self):
        ball = ball_bytes()
        (self.out / "deep").mkdir()
        for name in "data.npy", "deep/data.tif":
            (self.out / name).write_bytes(ball)
        self.image_of("a.mhd", self.meta("data.npy"))
        self.image_of("a.nhdr", self.nrrd("deep/data.tif"))
        self.image_of("abs.nhdr", self.nrrd(self.out / "data.npy"))
        self.keeps("a.mhd", "data.npy", "a.mhd")
        self.keeps("a.nhdr", "deep/data.tif", "a.nhdr")
        self.keeps("abs.nhdr", "data.npy")

    @unittest.skipIf(formats.MISSING, formats.MISSING)
    def test_pixels_of_ics(self):
        formats.write_ics(self.out / "a.ics", np.full(formats.SIZE[::-1], 7, np.uint8), version="1.0")
        self.run_covol("info", "a.ics")
        for path in "a.ids", "./a.ids":
            self.fails("segment", "a.ics", *LINE, "-o", "s.vdb", "--json", path, code=3, expected_text="of this run")
        self.assertEqual(self.bytes("a.ids"), bytes([7]) * math.prod(formats.SIZE))

    def test_pixels_in_many_files(self):
        ball = ball_bytes()
        for k in range(SIZE):
            (self.out / f"slice{k:03d}.npy").write_bytes(ball[k * SIZE * SIZE:(k + 1) * SIZE * SIZE])
        names = [f"slice{k:03d}.npy" for k in range(SIZE)]
        self.image_of("list.mhd", self.meta("LIST") + "\n".join(names) + "\n")
        self.image_of("numbers.mhd", self.meta(f"slice%03d.npy 0 {SIZE - 1} 1"))
        self.image_of("list.nhdr", self.nrrd("LIST") + "\n".join(names) + "\n")
        self.image_of("numbers.nhdr", self.nrrd(f"slice%03d.npy 0 {SIZE - 1} 1"))
        for image in "list.mhd", "numbers.mhd", "list.nhdr", "numbers.nhdr":
            with self.subTest(image):
                self.keeps(image, names[0], names[17], names[-1])

    @unittest.skipIf(formats.MISSING, formats.MISSING)
    def test_series_and_sets(self):
        data = np.full(formats.SIZE[::-1], 7, np.uint8)
        data[3:9, 5:20, 5:20] = 200
        names = sorted("series/" + path.name for path in formats.write_dicom_series(self.out / "series", data).iterdir())
        for image in "series", names[0]:
            with self.subTest(image):
                self.keeps(image, names[0], names[7], names[-1])
        # A JSON file in the folder of a DICOM series is not part of the image, so it may be replaced.
        (self.out / "series/notes.json").write_text("old")
        self.run_covol("info", "series", "--json", "series/notes.json")
        self.assertNotEqual(self.text("series/notes.json"), "old")
        names = ["part0.ome.tif", "part1.ome.tif"]
        slices = formats.SIZE[2]
        xml = formats.ome_xml([(names[k % 2], k // 2) for k in range(slices)])
        for n, name in enumerate(names):
            with formats.tifffile.TiffWriter(str(self.out / name)) as tiff:
                for k in range(n, slices, 2):
                    tiff.write(data[k], contiguous=False, metadata=None, description=xml if k == n else None)
        self.keeps(names[0], *names)
        (self.out / names[1]).unlink()
        os.mkfifo(self.out / names[1])
        self.fails("info", names[0], code=4, expected_text=names[1] + ": is not a regular file")

    def test_a_zarr_store(self):
        self.run_covol("phantom", "sphere", "--size", SIZE, "-o", "in.zarr")
        inside = sorted(str(p.relative_to(self.out)) for p in (self.out / "in.zarr").rglob("*") if p.is_file())
        self.keeps("in.zarr", *inside[:3])
        # No file may be added to a store that is an input: its name could be that of a chunk that the store lacks.
        self.fails("segment", "in.zarr", *LINE, "-o", "in.zarr/s.vdb", code=3, expected_text="lies in in.zarr")

    def test_a_configuration(self):
        (self.out / "c.toml").write_text("max-steps = 1\n")
        before = self.text("c.toml")
        self.fails("segment", self.image, "--points", "marks.xyz", "--init", "tag", "-o", "s.vdb", "--config", "c.toml",
                   "--save-config", "c.toml", code=3, expected_text="is an input")
        self.assertEqual(self.text("c.toml"), before)

    def test_frames(self):
        for n in range(2):
            (self.out / f"f{n}.nrrd").write_bytes(self.image.read_bytes())
            (self.out / f"m{n}.csv").write_text("x,y,z\n" + self.points.read_text().replace(" ", ","))
        before = self.bytes("m1.csv")
        self.fails("segment", "f0.nrrd", "f1.nrrd", "--points", "m{frame}.csv", "--init", "tag", "--max-steps", "1", "-o", "s.vdb",
                   "--table", "m1.csv", code=3, expected_text="is an input")
        self.assertEqual(self.bytes("m1.csv"), before)

    def test_as_the_system_does_it(self):
        (self.out / "d/sub").mkdir(parents=True)
        (self.out / "link").symlink_to("d/sub")
        self.run_covol(*PHANTOM, "-o", "link/../q.nrrd")
        self.assertTrue((self.out / "d/q.nrrd").is_file())
        self.assertFalse((self.out / "q.nrrd").exists())

    def test_an_output_that_is_a_link_is_written_through(self):
        (self.out / "d").mkdir()
        (self.out / "d/real.nrrd").write_text("old")
        os.chmod(self.out / "d/real.nrrd", 0o640)
        (self.out / "l.nrrd").symlink_to("d/real.nrrd")
        (self.out / "dangling.nrrd").symlink_to("d/fresh.nrrd")
        (self.out / "nowhere.nrrd").symlink_to("none/fresh.nrrd")
        (self.out / "folder.nrrd").symlink_to("d")
        for name in "l.nrrd", "dangling.nrrd":
            self.run_covol(*PHANTOM, "-o", name)
            self.assertTrue((self.out / name).is_symlink())
        self.assertEqual(self.bytes("d/real.nrrd"), self.bytes("d/fresh.nrrd"))
        self.assertEqual(stat.S_IMODE(os.stat(self.out / "d/real.nrrd").st_mode), 0o640)
        self.fails(*PHANTOM, "-o", "nowhere.nrrd", code=4, expected_text="does not exist")
        self.fails(*PHANTOM, "-o", "folder.nrrd", code=4, expected_text="it is a folder")
        # If the output is a link to a Zarr store, the store is replaced at the link's target, and the link stays.
        self.run_covol(*PHANTOM, "-o", "d/store.zarr")
        os.chmod(self.out / "d/store.zarr", 0o700)
        (self.out / "l.zarr").symlink_to("d/store.zarr")
        (self.out / "d/store.zarr/old").write_text("old")
        self.run_covol(*PHANTOM, "-o", "l.zarr/")
        self.assertTrue((self.out / "l.zarr").is_symlink())
        self.assertFalse((self.out / "d/store.zarr/old").exists())
        self.assertEqual(stat.S_IMODE(os.stat(self.out / "d/store.zarr").st_mode), 0o700)
        # same.csv is a link to t.csv: two outputs would be the same file.
        (self.out / "same.csv").symlink_to("t.csv")
        self.fails("segment", self.image, *LINE, "-o", "s.vdb", "--table", "t.csv", "--evidence", "same.csv", code=3,
                   expected_text="another output")

    def test_permissions_stay(self):
        old = os.umask(0o027)
        self.addCleanup(os.umask, old)
        names = ["o.nrrd", "p.xyz", "r.json", "l.zarr"]
        command = [*PHANTOM, "-o", "o.nrrd", "--points", "p.xyz", "--json", "r.json", "--labels", "l.zarr"]
        self.run_covol(*command)
        modes = [stat.S_IMODE(os.stat(self.out / name).st_mode) for name in names]
        self.assertEqual(modes, [0o640, 0o640, 0o640, 0o750])
        wanted = [0o600, 0o444, 0o664, 0o711]
        for name, mode in zip(names, wanted):
            os.chmod(self.out / name, mode)
        if os.geteuid() == 0:
            os.chown(self.out / "o.nrrd", 1234, 2345)
        self.run_covol(*command)
        self.assertEqual([stat.S_IMODE(os.stat(self.out / name).st_mode) for name in names], wanted)
        if os.geteuid() == 0:
            after = os.stat(self.out / "o.nrrd")
            self.assertEqual((after.st_uid, after.st_gid), (1234, 2345))


if __name__ == "__main__":
    unittest.main()
