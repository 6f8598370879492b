"""Locks, pipes and streams: what a run waits for, and output that cannot be written.

    COVOL=build/bin/covol python3 -m unittest tests/cli/pipes_test.py
"""
import fcntl
import os
import signal
import stat
import subprocess
import time
import unittest

from files_case import LINE, PHANTOM, PROGRAM, Files


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


if __name__ == "__main__":
    unittest.main()
