"""The bundle of tools/packaging/bundle.py: it uses nothing of this machine but the C library, and contains every licence.

    COVOL_BUILD=build python3 -m unittest tests/cli/bundle_test.py

tests/in_clean_root.sh runs it in fresh Debian systems without a compiler, which takes minutes.
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import unittest

from packages_test import run

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ.get("COVOL_BUILD", "build")).resolve()
C_LIBRARY = r"(linux-vdso|.*/ld-linux-[^/]*|libc|libm|libdl|librt|libpthread|libresolv)\.so\.\d+"


@unittest.skipUnless(shutil.which("patchelf") and shutil.which("dpkg"), "needs patchelf and dpkg")
class Bundle(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.work = pathlib.Path(tempfile.mkdtemp(prefix="covol-bundle-"))
        cls.addClassCleanup(shutil.rmtree, cls.work)
        run("cmake", "--build", BUILD, "--target", "covol_packed")
        cls.printed = run("/usr/bin/python3", ROOT / "tools/packaging/bundle.py", BUILD, "--output", cls.work, "--level", "0")
        [packed] = cls.work.glob("*.tar.xz")
        with tarfile.open(packed) as tar:
            cls.entries = tar.getmembers()
        run("tar", "xf", packed, "-C", cls.work)
        cls.root = cls.work / packed.name.removesuffix(".tar.xz")
        cls.elf = [path for path in cls.root.rglob("*") if path.is_file() and path.read_bytes()[:4] == b"\x7fELF"]
        # ROS, conda and modules of clusters set LD_LIBRARY_PATH to folders with other versions of the same libraries.
        # Here the folder contains invalid files with the names of the bundle's libraries, so that a program that loads
        # one of them fails.
        poison = cls.work / "poison"
        poison.mkdir()
        for path in (cls.root / "lib").glob("*.so*"):
            if path.is_file():
                (poison / path.name).write_text("not a library")
        cls.environment = {"PATH": "/usr/bin:/bin", "LD_LIBRARY_PATH": str(poison), "HOME": str(cls.work)}

    def test_only_the_c_library_is_the_machines_own(self):
        self.assertGreater(len(self.elf), 50)
        for path in self.elf:
            for line in run("ldd", path, env={"PATH": "/usr/bin:/bin"}).splitlines():
                name, _, place = line.strip().partition(" => ")
                if not re.fullmatch(C_LIBRARY, name.split(" (")[0]):
                    self.assertTrue(place.startswith(str(self.root)), f"{path}: {line}")

    def test_a_job_runs(self):
        def covol(*words):
            return run(self.root / "bin/covol", *words, env=self.environment, cwd=self.work)
        # NIfTI: read by the separately loaded ITK module.
        covol("phantom", "sphere", "--size", "32", "-o", "p.nii.gz", "--points", "p.csv")
        printed = covol("segment", "p.nii.gz", "--points", "p.csv", "-o", "s.vdb", "--mesh", "s.ply", "--report", "s.html")
        self.assertIn("closed, genus 0", printed)
        self.assertGreater((self.work / "s.html").stat().st_size, 100_000)

    def test_the_builds_results_to_the_bit(self):
        """On images, a cloud and a format of ITK; running all jobs takes minutes (docs/install.md)."""
        for part in ("image", "cloud_few", "phantom_box"):
            printed = run(sys.executable, ROOT / "tests/bench/same_bits.py", BUILD / "bin/covol", self.root / "bin/covol", "--only", part, "--work",
                       self.work / f"bits_{part}")
            self.assertRegex(printed, r"\d+ jobs: 0 differ \[\]; 0 end with an error")

    def test_the_doctor_finds_its_own_parts(self):
        root = self.work / "damaged"
        shutil.copytree(self.root, root, symlinks=True)
        environment = {**self.environment, "LD_LIBRARY_PATH": ""}
        printed = run(root / "bin/covol", "doctor", "--strict", env=environment)
        self.assertIn(f"in {root}/lib\n", printed)
        next(root.glob("lib/covol-*/gdcm.so")).unlink()
        done = subprocess.run([root / "bin/covol", "doctor", "--strict"], capture_output=True, text=True, env=environment)
        self.assertEqual(done.returncode, 5, done.stdout + done.stderr)
        self.assertIn("gdcm.so", done.stderr)
        self.assertIn("reader itk: found", done.stdout)
        (root / "share/covol/demo/celegans_embryo.tif").unlink()
        done = subprocess.run([root / "bin/covol", "demo", "--no-browser"], capture_output=True, text=True, env=environment, cwd=self.work)
        self.assertEqual(done.returncode, 4, done.stdout + done.stderr)
        self.assertIn("expected the sample that is installed with covol", done.stderr)

    def test_every_file_has_its_package_and_licence(self):
        rows = [line.split("\t") for line in (self.root / "share/doc/covol/FILES.txt").read_text().splitlines()[1:]]
        listed = {row[0]: row for row in rows}
        licences = self.root / "share/doc/covol/licences"
        for path in self.elf:
            name, package, licence = listed[str(path.relative_to(self.root))]
            self.assertTrue(package and licence, name)
            if package != "covol":
                self.assertGreater((licences / package.split()[0]).stat().st_size, 100, name)
        self.assertTrue(listed["lib/libtbb.so.12"][1].startswith("libtbb12 "))
        self.assertIn("Apache-2.0", listed["lib/libtbb.so.12"][2])

    def test_plain_entries(self):
        for entry in self.entries:
            self.assertTrue(entry.name.startswith(self.root.name) and ".." not in entry.name.split("/"), entry.name)
            self.assertEqual((entry.uid, entry.gid, 0 if entry.issym() else entry.mode & 0o7022), (0, 0, 0), entry.name)
        self.assertEqual(len({entry.mtime for entry in self.entries}), 1)


if __name__ == "__main__":
    unittest.main()
