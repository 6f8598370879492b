"""The environment of a run: full disks, folders and names of all kinds, few file handles, no terminal, no home directory.

    COVOL=build/bin/covol python3 -m unittest tests/cli/surroundings_test.py
"""
import hashlib
import os
import pathlib
import resource
import shutil
import signal
import subprocess
import tempfile
import unittest

from covol_case import COVOL, Case

OUTPUTS = {"-o": "s.vdb", "--mesh": "s.ply", "--mask": "s.nrrd"}


class Run(Case):
    """A job with three outputs that replace older ones, which were made with other options."""

    def command(self, *more, folder=""):
        outputs = [word for flag, name in OUTPUTS.items() for word in (flag, os.path.join(folder, name))]
        return [str(pathlib.Path(COVOL).resolve()), "segment", str(self.image), "--points", str(self.points), "--init", "tag",
                "--max-steps", "1", "--quiet", *outputs, *more]

    def go(self, *more, folder="", **how):
        return subprocess.run(self.command(*more, folder=folder), cwd=self.out, capture_output=True, timeout=300, **how)

    def state(self, folder=""):
        return {name: hashlib.sha256((self.out / folder / name).read_bytes()).hexdigest() for name in OUTPUTS.values()}

    def hidden(self, folder=""):
        return [p.name for p in (self.out / folder).iterdir() if p.name.startswith(".")]

    def with_older_outputs(self, folder=""):
        self.assertEqual(self.go("--delta", "3vx", folder=folder).returncode, 0)
        return self.state(folder)

    def refused(self, done, code, expected_text):
        """Checks for one clear error line, after warnings about the result."""
        text = done.stderr.decode()
        self.assertEqual(done.returncode, code, text)
        *before, last = text.strip().splitlines()
        self.assertTrue(all(line.startswith("covol: warning: ") for line in before), text)
        self.assertTrue(last.startswith("covol: error: "), text)
        self.assertIn(expected_text, last)


class Disks(Run):
    def test_a_quota(self):
        # A limit for the size of files, as by a quota, lets the writing of the outputs fail. The sizes are bytes.
        before = self.with_older_outputs()
        for size in 100, 20_000, 60_000:
            with self.subTest(size):
                def limited():
                    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
                    resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))
                self.refused(self.go(preexec_fn=limited), 4, "File too large")
                self.assertEqual((self.state(), self.hidden()), (before, []))

    def test_a_limit_that_sends_a_signal(self):
        before = self.with_older_outputs()
        self.refused(self.go(preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))), 4, "File too large")
        self.assertEqual((self.state(), self.hidden()), (before, []))

    @unittest.skipUnless(os.geteuid() == 0, "who is not root mounts no disk")
    def test_a_full_disk(self):
        (self.out / "disk").mkdir()
        if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=700k", "none", self.out / "disk"], capture_output=True).returncode:
            self.skipTest("a disk cannot be mounted here")
        self.addCleanup(subprocess.run, ["umount", self.out / "disk"], check=True)
        before = self.with_older_outputs("disk")
        room = os.statvfs(self.out / "disk")
        (self.out / "disk/full").write_bytes(bytes(room.f_bavail * room.f_frsize - 30_000))
        self.refused(self.go(folder="disk"), 4, "No space left")
        self.assertEqual((self.state("disk"), self.hidden("disk")), (before, []))

    def test_a_folder_that_cannot_be_written_to(self):
        before = self.with_older_outputs()
        self.out.chmod(0o555)
        self.inputs.chmod(0o755)
        self.addCleanup(self.inputs.chmod, 0o700)
        self.addCleanup(self.out.chmod, 0o700)
        how = {"user": 65534, "group": 65534} if os.geteuid() == 0 else {}
        self.refused(self.go(**how), 4, "no permission")
        self.assertEqual((self.state(), self.hidden()), (before, []))

    def test_two_runs_on_one_output(self):
        sets = []
        for delta in "1vx", "3vx":
            self.assertEqual(self.go("--delta", delta).returncode, 0)
            sets.append(self.state())
        for _ in range(5):
            runs = [subprocess.Popen(self.command("--delta", delta), cwd=self.out, stderr=subprocess.PIPE) for delta in ("1vx", "3vx")]
            ends = [(run.communicate(timeout=300)[1], run.returncode) for run in runs]
            self.assertTrue(all(code in (0, 4) for _, code in ends), ends)
            self.assertIn(self.state(), sets)
            self.assertEqual(self.hidden(), [])


class Names(Run):
    def test_names_of_all_kinds(self):
        self.assertEqual(self.go().returncode, 0)
        expected = self.state()
        for name in "two words", "two\nlines", "Grüße 漢字 🧪", "-dash", "per%cent", "quote'\"s", "a" * 255:
            with self.subTest(name):
                (self.out / name).mkdir()
                shutil.copy(self.image, self.out / name / "i.nrrd")
                done = self.go(folder="./" + name)
                self.assertEqual(done.returncode, 0, done.stderr)
                self.assertEqual(self.state(name), expected)
                self.run_covol("info", f"./{name}/i.nrrd")

    def test_a_path_of_four_thousand_characters(self):
        self.assertEqual(self.go().returncode, 0)
        expected = self.state()
        parts, folder = [], str(self.out)
        while len(folder) + 201 < 4000:
            parts.append("d" * 200)
            folder += "/" + parts[-1]
        os.makedirs(folder)
        done = self.go(folder=folder)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual({name: hashlib.sha256(pathlib.Path(folder, name).read_bytes()).hexdigest() for name in expected}, expected)
        # A folder name longer than the system allows is an error.
        self.refused(self.go(folder=folder + "/" + "e" * 300), 4, "too long")


class Processes(Run):
    def test_few_file_handles(self):
        self.assertEqual(self.go().returncode, 0)
        expected = self.state()
        for handles in 32, 16, 9:
            with self.subTest(handles):
                done = self.go(preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (handles, handles)))
                if handles < 16:
                    self.refused(done, 4, "Too many open files")
                else:
                    self.assertEqual(done.returncode, 0, done.stderr)
                self.assertEqual((self.state(), self.hidden()), (expected, []))

    def test_closed_streams(self):
        for closed in (1,), (2,), (0, 1, 2):
            with self.subTest(closed):
                for name in self.files():
                    (self.out / name).unlink()
                done = subprocess.run(self.command("--json", "r.json"), cwd=self.out, timeout=300,
                                      preexec_fn=lambda: [os.close(stream) for stream in closed])
                self.assertEqual(done.returncode, 0)
                self.assertEqual(self.files(), ["r.json", *sorted(OUTPUTS.values())])
        # For info, standard output is the result: it is an error if it is closed or full.
        done = subprocess.run([COVOL, "info", str(self.image)], stderr=subprocess.PIPE, timeout=300, preexec_fn=lambda: os.close(1))
        self.assertEqual(done.returncode, 4, done.stderr)
        with open("/dev/full", "w") as full:
            done = subprocess.run([COVOL, "info", str(self.image)], stdout=full, stderr=subprocess.PIPE, timeout=300)
        self.assertEqual(done.returncode, 4, done.stderr)

    def test_no_environment_at_all(self):
        self.assertEqual(self.go().returncode, 0)
        expected = self.state()
        keep = {name: os.environ[name] for name in ("LD_LIBRARY_PATH",) if name in os.environ}
        done = self.go(env=keep)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(self.state(), expected)
        # rerun needs a folder for temporary files. It succeeds without HOME and TMPDIR; a TMPDIR that does not exist is
        # an error.
        self.run_covol("segment", self.image, "--points", self.points, "--init", "tag", "--max-steps", "1", "-o", "again.vdb")
        for environment in (keep, {**keep, "TMPDIR": "/nowhere"}):
            done = subprocess.run([str(pathlib.Path(COVOL).resolve()), "rerun", "again.vdb", "--inputs", str(self.inputs), "--quiet"],
                                  cwd=self.out, env=environment, capture_output=True, timeout=300)
            if "TMPDIR" in environment:
                self.refused(done, 4, "/nowhere")
            else:
                self.assertEqual(done.returncode, 0, done.stderr)

    def test_a_decimal_comma(self):
        folder = tempfile.mkdtemp(prefix="covol-locale-")
        self.addCleanup(shutil.rmtree, folder)
        if not shutil.which("localedef") or subprocess.run(["localedef", "-i", "de_DE", "-f", "UTF-8", folder + "/de_DE.UTF-8"],
                                                           capture_output=True).returncode > 1:
            self.skipTest("a locale with a decimal comma cannot be made here")
        self.assertEqual(self.go().returncode, 0)
        expected = self.state()
        environment = {**os.environ, "LOCPATH": folder, "LC_ALL": "de_DE.UTF-8", "LANG": "de_DE.UTF-8"}
        done = self.go(env=environment)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(self.state(), expected)


del Run, Case  # base classes: unittest would run them, too

if __name__ == "__main__":
    unittest.main()
