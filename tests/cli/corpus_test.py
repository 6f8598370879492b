"""Files from guided fuzzing: none of them crashes its reader, hangs it or makes it allocate too much memory."""
import os
import pathlib
import shutil
import subprocess
import tarfile
import tempfile
import unittest

FUZZ = pathlib.Path(__file__).resolve().parents[1] / "fuzz"


class Corpus(unittest.TestCase):
    def test_each_file(self):
        with tempfile.TemporaryDirectory(prefix="covol-corpus-") as folder:
            with tarfile.open(FUZZ / "corpus.tar.xz") as archive:
                archive.extractall(folder)
            for path in (FUZZ / "regressions/pixels").iterdir():  # valid headers, damaged voxels
                shutil.copy(path, pathlib.Path(folder) / path.suffix[1:])
            formats = sorted(pathlib.Path(folder).iterdir())
            self.assertGreaterEqual(len(formats), 20)
            done = subprocess.run([os.environ["COVOL_READ_CORPUS"], folder], capture_output=True, text=True, errors="replace", timeout=600)
            lines = [line for line in done.stdout.splitlines() if folder in line]  # without warnings of OpenVDB
            self.assertEqual(done.returncode, 0, done.stdout[-2000:] + done.stderr[-2000:])
            self.assertEqual(len(lines), sum(len(list(one.iterdir())) for one in formats))


if __name__ == "__main__":
    unittest.main()
