"""Files that guided fuzzing found worth keeping: none crashes its reader, hangs it or makes it take memory."""
import os
import pathlib
import subprocess
import tarfile
import tempfile
import unittest

CORPUS = pathlib.Path(__file__).resolve().parents[1] / "fuzz/corpus.tar.xz"


class Corpus(unittest.TestCase):
    def test_each_file(self):
        with tempfile.TemporaryDirectory(prefix="covol-corpus-") as folder:
            with tarfile.open(CORPUS) as archive:
                archive.extractall(folder)
            formats = sorted(pathlib.Path(folder).iterdir())
            self.assertGreaterEqual(len(formats), 20)
            done = subprocess.run([os.environ["COVOL_READ_CORPUS"], folder], capture_output=True, text=True, errors="replace", timeout=600)
            lines = done.stdout.splitlines()
            self.assertEqual(done.returncode, 0, "\n".join(lines[-20:]) + done.stderr[-2000:])
            self.assertEqual(len(lines), sum(len(list(one.iterdir())) for one in formats))


if __name__ == "__main__":
    unittest.main()
