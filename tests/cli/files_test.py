"""Files around a run: which leftovers are removed, what is waited for, where outputs are written, and which files must not be
replaced.

    COVOL=build/bin/covol COVOL_KILL_AT=build/tests/libcovol_kill_at.so python3 -m unittest tests/cli/files_test.py
"""
import fcntl
import hashlib
import math
import os
import pathlib
import signal
import stat
import subprocess
import time
import unittest

import numpy as np

import image_formats_test as formats
from covol_case import COVOL, ORIGIN, H, SIZE, Case, ball_bytes

PROGRAM = str(pathlib.Path(COVOL).resolve())
PHANTOM = ["phantom", "sphere", "--size", "16"]
LINE = ["--points", "marks.xyz", "--init", "tag", "--max-steps", "1"]


class Files(Case):
    def setUp(self):
        super().setUp()
        os.symlink(self.points, self.out / "marks.xyz")

    def hidden(self, folder="."):
        return sorted(p.name for p in (self.out / folder).iterdir() if p.name.startswith("."))

    def text(self, name):
        return (self.out / name).read_text()

    def bytes(self, name):
        return (self.out / name).read_bytes()

    def start(self, *args, **how):
        return subprocess.Popen([PROGRAM, *map(str, args)], cwd=self.out, stderr=subprocess.PIPE, text=True, **how)

    def fails(self, *args, code, expected_text, **how):
        done = subprocess.run([PROGRAM, *map(str, args), "--quiet"], cwd=self.out, capture_output=True, text=True, timeout=120, **how)
        self.assertEqual(done.returncode, code, done.stderr)
        self.assertIn(expected_text, done.stderr.strip().splitlines()[-1])
        return done


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


class Waits(Files):
    """No wait is endless, and the first signal ends each wait."""

    def interrupted(self, run):
        begin = time.monotonic()
        run.send_signal(signal.SIGINT)
        text = run.communicate(timeout=30)[1]
        self.assertLess(time.monotonic() - begin, 20)
        return text

    def test_a_folder_that_another_program_has_locked(self):
        (self.out / "x.nrrd").write_text("old")
        folder = os.open(self.out, os.O_RDONLY)
        self.addCleanup(os.close, folder)
        fcntl.flock(folder, fcntl.LOCK_EX)
        # The run waits for the lock before it begins, names the process that holds it, and ends at the first signal.
        run = self.start(*PHANTOM, "-o", "x.nrrd")
        line = run.stderr.readline()
        self.assertIn(f"waiting for process {os.getpid()} (", line)
        self.interrupted(run)
        self.assertEqual(run.returncode, 130)
        self.assertEqual(self.text("x.nrrd"), "old")
        # When the lock is released, the waiting run continues and replaces the file.
        run = self.start(*PHANTOM, "-o", "x.nrrd")
        self.assertIn("waiting for process", run.stderr.readline())
        fcntl.flock(folder, fcntl.LOCK_UN)
        run.communicate(timeout=60)
        self.assertEqual(run.returncode, 0)
        self.assertNotEqual(self.bytes("x.nrrd"), b"old")
        self.assertEqual(self.hidden(), [])

    def test_a_lock_that_comes_while_a_run_works(self):
        run = self.start("segment", self.image, "--points", "marks.xyz", "--init", "tag", "-o", "s.vdb", "--max-steps", "3")
        while not (line := run.stderr.readline()).startswith("covol: tag_distance"):
            self.assertTrue(line, "ended too early")
        with open(self.inputs / "ball.xyz"):
            folder = os.open(self.out, os.O_RDONLY)
            self.addCleanup(os.close, folder)
            fcntl.flock(folder, fcntl.LOCK_EX)
        while "waiting for process" not in (line := run.stderr.readline()):
            self.assertTrue(line, "ended without waiting")
        self.interrupted(run)
        self.assertEqual(run.returncode, 130)
        self.assertFalse((self.out / "s.vdb").exists())
        self.assertEqual(self.hidden(), [])

    def test_pipes_in_the_place_of_files(self):
        """Named pipes without a writer: as each kind of input, and as files named in headers."""
        nrrd = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 16 16 {}\nencoding: {}\n"
        meta = "NDims = 3\nDimSize = 16 16 {}\nElementSpacing = 1 1 1\nElementType = MET_UCHAR\n"
        headers = {
            "one.nhdr": nrrd.format(16, "raw") + "data file: pipe.raw\n",
            "packed.nhdr": nrrd.format(16, "gzip") + "data file: pipe.raw\n",
            "bz.nhdr": nrrd.format(16, "bzip2") + "data file: pipe.raw\n",
            "text.nhdr": nrrd.format(16, "ascii") + "data file: pipe.raw\n",
            "list.nhdr": nrrd.format(2, "raw") + "data file: LIST\npipe.raw\npipe.raw\n",
            "numbers.nhdr": nrrd.format(2, "raw") + "data file: pipe%d.raw 1 2 1\n",
            "one.mhd": meta.format(16) + "ElementDataFile = pipe.raw\n",
            "packed.mhd": meta.format(16) + "CompressedData = True\nElementDataFile = pipe.raw\n",
            "skipped.mhd": meta.format(16) + "HeaderSize = 12\nElementDataFile = pipe.raw\n",
            "list.mhd": meta.format(2) + "ElementDataFile = LIST\npipe.raw\npipe.raw\n",
            "numbers.mhd": meta.format(2) + "ElementDataFile = pipe%01d.raw 1 2 1\n",
            "pipe.ics": "\t\nics_version\t1.0\nlayout\torder\tbits\tx\ty\tz\nlayout\tsizes\t8\t16\t16\t16\n"
                        "representation\tformat\tinteger\nrepresentation\tsign\tunsigned\n",
        }
        for name in "pipe.raw", "pipe1.raw", "pipe2.raw", "pipe.ids":
            os.mkfifo(self.out / name)
        for name, text in headers.items():
            (self.out / name).write_text(text)
            with self.subTest(name):
                self.fails("info", name, code=4, expected_text="pipe")
                self.fails("convert", name, "o.vdb", code=4, expected_text="pipe")
        self.run_covol(*PHANTOM, "-o", "chunk.zarr")
        chunk = max((p for p in (self.out / "chunk.zarr").rglob("*") if p.is_file()), key=lambda p: p.stat().st_size)
        chunk.unlink()
        os.mkfifo(chunk)
        (self.out / "v.zarr").mkdir()
        for name in (".zarray", "zarr.json", ".zattrs"):
            os.mkfifo(self.out / "v.zarr" / name)
        (self.out / "folder").mkdir()
        os.mkfifo(self.out / "folder/slice.dcm")
        (self.out / "plan").mkdir()
        os.mkfifo(self.out / "plan/plan.json")
        (self.out / "states").mkdir()
        os.mkfifo(self.out / "states/job.txt")
        for end in ("tif", "nrrd", "nii", "nii.gz", "mha", "mrc", "ics", "npy", "h5", "ims", "dcm", "vdb", "xyz", "csv", "ply", "obj",
                    "stl", "off", "glb", "las", "zip", "roi", "xml", "json"):
            os.mkfifo(self.out / ("p." + end))
        for end in "tif", "nrrd", "nii", "nii.gz", "mha", "mrc", "ics", "npy", "h5", "ims", "dcm", "vdb":
            with self.subTest(end):
                self.fails("info", "p." + end, code=4, expected_text="p." + end)
        for end in "xyz", "csv", "ply", "obj", "off", "las", "zip", "roi", "xml", "json":
            with self.subTest("points " + end):
                self.fails("reconstruct", "p." + end, "-o", "o.vdb", code=4, expected_text="p." + end)
                self.fails("segment", self.image, "--contours", "p." + end, "-o", "o.vdb", code=4, expected_text="p." + end)
        for end in "ply", "obj", "stl", "off", "glb":
            with self.subTest("mesh " + end):
                self.fails("check", "p." + end, code=4, expected_text="p." + end)
        mask = ["segment", self.image, "-o", "o.vdb"]
        for code, args in ((3, ["info", "v.zarr"]), (4, ["convert", "chunk.zarr", "o.vdb"]), (3, ["info", "folder"]), (4, ["brick", "run", "plan"]),
                           (4, ["report", self.image, "--points", "marks.xyz", "-o", "o.html", "--run-report", "p.json"]),
                           (3, [*mask, *LINE, "--checkpoint", "states"]), (4, [*mask, "--painted", "p.nrrd"]),
                           (4, [*mask, "--guess", "p.nrrd"]), (4, [*mask, *LINE, "--inside", "p.csv"]),
                           (4, ["rerun", "p.vdb"])):
            with self.subTest(args[0] + " " + str(args[-1])):
                self.fails(*args, code=code, expected_text="")

    def test_points_that_come_through_a_pipe(self):
        points = self.points.read_text()
        done = subprocess.run([PROGRAM, "reconstruct", "-", "-o", "o.vdb", "--quiet"], cwd=self.out, input=points, text=True,
                              capture_output=True, timeout=120)
        self.assertEqual(done.returncode, 0, done.stderr)
        run = self.start("reconstruct", "-", "-o", "o.vdb", stdin=subprocess.PIPE)
        time.sleep(0.5)
        self.interrupted(run)
        self.assertIn(run.returncode, (130, -signal.SIGINT))

    def test_a_configuration_that_nobody_writes(self):
        os.mkfifo(self.out / "c.toml")
        run = self.start(*PHANTOM, "-o", "x.nrrd", "--config", "c.toml")
        time.sleep(0.5)
        self.interrupted(run)
        self.assertIn(run.returncode, (130, -signal.SIGINT))

    def test_a_pipe_that_nobody_reads(self):
        os.mkfifo(self.out / "pipe")
        run = self.start(*PHANTOM, "-o", "x.nrrd", "--json", "pipe")
        while "waiting for a program that reads this pipe" not in (line := run.stderr.readline()):
            self.assertTrue(line, "ended without waiting")
        self.interrupted(run)
        self.assertEqual(run.returncode, 130)
        self.assertFalse((self.out / "x.nrrd").exists())
        # A pipe that is full and no longer read: writing the report to it blocks until the signal.
        read, write = os.pipe()
        self.addCleanup(os.close, read)
        os.set_blocking(write, False)
        try:
            while os.write(write, bytes(4096)):
                pass
        except BlockingIOError:
            pass
        os.set_blocking(write, True)
        run = self.start(*PHANTOM, "-o", "x.nrrd", "--json", "-", stdout=write)
        os.close(write)
        time.sleep(1)
        self.interrupted(run)
        self.assertEqual(run.returncode, 130)
        self.assertFalse((self.out / "x.nrrd").exists())

    def test_a_pipe_with_a_reader(self):
        os.mkfifo(self.out / "pipe")
        run = self.start(*PHANTOM, "-o", "x.nrrd", "--json", "pipe", "--quiet")
        with open(self.out / "pipe") as pipe:
            self.assertIn('"command": "phantom"', pipe.read())
        run.communicate(timeout=60)
        self.assertEqual(run.returncode, 0)
        self.assertTrue(stat.S_ISFIFO(os.stat(self.out / "pipe").st_mode))


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


class Streams(Files):
    """If output that was requested on a stream cannot be written there, the run ends with an error and a message."""

    def commands(self):
        self.segment("--max-steps", "1", "--init", "tag")
        texts = ["--help", "--help-all", "--version", "segment --help", "segment --help-all", f"info {self.image}",
                 "info s.vdb", f"compare {self.image} {self.image}", f"check {self.image}", "check s.vdb",
                 f"plan segment {self.image} --points marks.xyz -o t.vdb", "rerun s.vdb --inputs " + str(self.inputs),
                 "phantom sphere --size 16 -o t.nrrd --json -", f"info {self.image} --json -",
                 f"segment {self.image} --points marks.xyz --init tag --max-steps 1 -o t.vdb --json -",
                 "phantom sphere --size 16 -o t.nrrd --json /dev/fd/1",
                 "phantom sphere --size 16 -o t.nrrd --save-config /dev/fd/1"]
        return [text.split() for text in texts]

    def test_standard_output_is_full_or_closed(self):
        for words in self.commands():
            with self.subTest(" ".join(words)), open("/dev/full", "w") as full:
                self.assertTrue(subprocess.run([PROGRAM, *words], cwd=self.out, capture_output=True, timeout=120).stdout)
                for name in "t.nrrd", "t.vdb":
                    (self.out / name).unlink(missing_ok=True)
                for how in {"stdout": full}, {"preexec_fn": lambda: os.close(1)}:
                    done = subprocess.run([PROGRAM, *words], cwd=self.out, stderr=subprocess.PIPE, text=True, timeout=120, **how)
                    self.assertEqual(done.returncode, 4, done.stderr)
                    self.assertRegex(done.stderr.strip().splitlines()[-1], "^covol: error: .*cannot write")
                    self.assertFalse((self.out / "t.nrrd").exists() or (self.out / "t.vdb").exists())

    def test_outputs_on_a_device_that_is_full(self):
        (self.out / "full.csv").symlink_to("/dev/full")
        base = ["segment", self.image, *LINE, "-o", "t.vdb"]
        for flag, path in (("--json", "/dev/full"), ("--save-config", "/dev/full"), ("--table", "full.csv"), ("--evidence", "full.csv")):
            with self.subTest(flag):
                self.fails(*base, flag, path, code=4, expected_text="cannot write: No space left on device")
                self.assertFalse((self.out / "t.vdb").exists())

    def test_a_stream_that_is_a_file_goes_on(self):
        with open(self.out / "log", "w") as log:
            log.write("before\n")
            log.flush()
            subprocess.run([PROGRAM, *PHANTOM, "-o", "x.nrrd", "--json", "/dev/fd/1"], cwd=self.out, stdout=log, check=True,
                           stderr=subprocess.DEVNULL)
            log.write("after\n")
        text = self.text("log")
        self.assertTrue(text.startswith("before\n{") and text.endswith("}\nafter\n"), text)


del Files, Case  # base classes: unittest would run them, too

if __name__ == "__main__":
    unittest.main()
