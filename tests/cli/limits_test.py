"""Limits of memory and of threads: control groups, small files that claim large sizes, threads that the system refuses to create.

    COVOL=build/bin/covol COVOL_NO_THREADS=build/tests/libcovol_no_threads.so python3 -m unittest tests/cli/limits_test.py
"""
import contextlib
import hashlib
import json
import os
import pathlib
import resource
import struct
import subprocess
import unittest
import zipfile

import numpy as np

from covol_case import COVOL, Case, write_nrrd

MIB = 1 << 20


class Limited(Case):
    def peak(self, *words, **how):
        """@return exit code (minus the signal's number if killed), peak of resident memory in bytes, standard error"""
        with open(self.out / "errors", "w+") as errors:
            run = subprocess.Popen([str(pathlib.Path(COVOL).resolve()), *map(str, words)], cwd=self.out, stdout=subprocess.DEVNULL,
                                   stderr=errors, **how)
            _, status, usage = os.wait4(run.pid, 0)
            run.returncode = os.waitstatus_to_exitcode(status)
            errors.seek(0)
            text = errors.read()
        (self.out / "errors").unlink()
        return run.returncode, usage.ru_maxrss * 1024, text


class ControlGroups(Limited):
    LIMIT = 200 * MIB

    @staticmethod
    def memory_folder():
        """The folder in the memory controller's hierarchy in which this process may create groups, and the name of the limit there."""
        own = {}
        for line in pathlib.Path("/proc/self/cgroup").read_text().splitlines():
            _, controllers, group = line.split(":", 2)
            own[controllers] = group
        for line in pathlib.Path("/proc/self/mountinfo").read_text().splitlines():
            words, _, filesystem = line.partition(" - ")
            kind, _, options = filesystem.split()[:3]
            mount = pathlib.Path(words.split()[4])
            if kind == "cgroup" and "memory" in options.split(",") and "memory" in own:
                return mount / own["memory"].lstrip("/"), "memory.limit_in_bytes"
            if kind == "cgroup2" and "memory" in (mount / "cgroup.subtree_control").read_text().split():
                return mount, "memory.max"
        return None, None

    @contextlib.contextmanager
    def group(self):
        """The cgroup.procs file of a group without a limit of its own, within a group limited to 200 MiB."""
        folder, limit = self.memory_folder()
        if folder is None:
            self.skipTest("no hierarchy of control groups has a memory controller")
        outer = folder / f"covol-test-{os.getpid()}"
        inner = outer / "step"
        try:
            outer.mkdir()
        except OSError as why:
            self.skipTest(f"no control group can be made here: {why}")
        try:
            (outer / limit).write_text(str(self.LIMIT))
            if limit == "memory.max":
                (outer / "cgroup.subtree_control").write_text("+memory")
            inner.mkdir()
            yield inner / "cgroup.procs"
        finally:
            for made in (inner, outer):
                if made.exists():
                    made.rmdir()

    def setUp(self):
        super().setUp()
        self.run_covol("phantom", "torus", "--size", 448, "--count", 200000, "-o", "t.nrrd", "--points", "t.ply")

    def test_jobs_that_need_more_than_their_group_has_are_reported(self):
        self.run_covol("distance", "t.ply", "--like", "t.nrrd", "-o", "d.vdb", "--max-distance", "8vx")
        self.run_covol("band", "d.vdb", "-o", "b.vdb", "--tag-distance", "3vx")
        before = self.files()
        # Without a limit, each of these jobs uses 210 to 450 MB, which is more than the group allows (LIMIT, 200 MiB).
        jobs = {
            "convert": ["convert", "t.nrrd", "o.vdb"],
            "distance": ["distance", "t.ply", "--like", "t.nrrd", "-o", "o.vdb", "--max-distance", "90vx"],
            "evolve": ["evolve", "b.vdb", "--distance", "d.vdb", "-o", "o.vdb", "--rho", 0],
            "segment": ["segment", "t.nrrd", "--points", "t.ply", "--init", "tag", "-o", "o.vdb", "--mesh", "o.ply"],
        }
        with self.group() as processes:
            for name, words in jobs.items():
                with self.subTest(name):
                    code, _, text = self.peak(*words, "--quiet", preexec_fn=lambda: processes.write_text(str(os.getpid())))
                    self.assertEqual(code, 3, text)
                    self.assertIn("memory", text)
                    # A job may also be refused before it allocates memory, with the advice to use larger voxels.
                    if "voxel size" not in text:
                        self.assertIn("control group", text)
                    self.assertEqual(self.files(), before)
            code, _, text = self.peak("info", "t.nrrd", preexec_fn=lambda: processes.write_text(str(os.getpid())))
            self.assertEqual(code, 0, text)

    def test_what_began_the_program_does_not_count(self):
        held = bytearray(os.urandom(1)) * (400 * MIB)
        self.assertLess(self.report("info", self.image)["peak_rss_bytes"], 200 * MIB)
        del held

    def test_a_limit_of_address_space(self):
        before = self.files()
        code, _, text = self.peak("convert", "t.nrrd", "o.vdb", "--quiet", preexec_fn=lambda: resource.setrlimit(
            resource.RLIMIT_AS, (600 * MIB, 600 * MIB)))
        self.assertEqual(code, 3, text)
        self.assertIn("memory", text)
        self.assertEqual(self.files(), before)


class Threads(Limited):
    JOB = ["-o", "s.vdb", "--mesh", "s.ply", "--init", "tag", "--max-steps", "2", "--quiet"]

    def digests(self):
        return {name: hashlib.sha256((self.out / name).read_bytes()).hexdigest() for name in self.files()}

    def ends_well(self, code, _, text, expected, seen):
        """Either the same bits with fewer threads, or one clear error and no file."""
        seen.add(code)
        self.assertIn(code, (0, 4), text)
        if code == 0:
            return self.assertEqual(self.digests(), expected)
        *before, last = text.strip().splitlines()
        self.assertTrue(all(line.startswith("covol: warning: ") for line in before), text)
        self.assertTrue(last.startswith("covol: error: "), text)
        self.assertIn("threads", last)
        self.assertEqual([p.name for p in self.out.iterdir()], [])

    def test_whichever_thread_or_copy_cannot_be_made(self):
        preload = os.environ.get("COVOL_NO_THREADS")
        if not preload:
            self.skipTest("COVOL_NO_THREADS is not set")
        job = ["segment", self.image, "--points", self.points, *self.JOB]
        self.run_covol(*job)
        expected, seen = self.digests(), set()
        for n in range(1, 20):
            with self.subTest(n):
                for name in self.files():
                    (self.out / name).unlink()
                self.ends_well(*self.peak(*job, env={**os.environ, "LD_PRELOAD": preload, "FAIL_FROM": str(n)}), expected, seen)
        self.assertIn(0, seen)

    def test_a_limit_of_processes(self):
        # RLIMIT_NPROC does not apply to root, so a test run as root changes to the user nobody (65534).
        user = 65534 if os.geteuid() == 0 else os.geteuid()

        def limited(count):
            if os.geteuid() == 0:
                os.setgroups([])
                os.setgid(user)
                os.setuid(user)
            resource.setrlimit(resource.RLIMIT_NPROC, (count, count))

        job = ["segment", self.image, "--points", self.points, *self.JOB]
        self.run_covol(*job)
        expected, seen = self.digests(), set()
        for folder in (self.inputs, self.out):
            folder.chmod(0o755)
            os.chown(folder, user, -1)
        try:
            subprocess.run([pathlib.Path(COVOL).resolve(), "--version"], check=True, capture_output=True, preexec_fn=lambda: limited(100))
        except (OSError, subprocess.SubprocessError) as why:
            self.skipTest(f"another user cannot run covol: {why}")
        for count in range(1, 12):
            with self.subTest(count):
                for name in self.files():
                    (self.out / name).unlink()
                self.ends_well(*self.peak(*job, preexec_fn=lambda: limited(count)), expected, seen)
        self.assertIn(0, seen)


def bomb_of_rois(path, entries, points):
    """Archives of multi-point ROIs, all of them at 0."""
    header = bytearray(64)
    struct.pack_into(">4shB", header, 0, b"Iout", 227, 10)
    struct.pack_into(">I", header, 18, points)
    struct.pack_into(">i", header, 56, 1)  # the slice of the points, counted from 1
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for n in range(entries):
            archive.writestr(f"{n}.roi", bytes(header) + bytes(4 * points))


class SmallFiles(Limited):
    """Sizes that files claim are compared with the allowed memory before anything is allocated."""

    ALLOWED = 300 * MIB

    def refused(self, *words, expected_text="memory"):
        # A limit of 8 GiB for the address space protects the machine from a program that allocates what a file claims.
        code, peak, text = self.peak(*words, "--quiet", preexec_fn=lambda: resource.setrlimit(
            resource.RLIMIT_AS, (8 << 30, 8 << 30)))
        self.assertEqual(code, 3, text)
        self.assertIn(expected_text, text)
        self.assertLess(peak, self.ALLOWED, words)
        self.assertEqual(self.files(), [])

    def test_an_image_without_chunks(self):
        store = self.inputs / "huge.zarr"
        store.mkdir()
        (store / "zarr.json").write_text(json.dumps({
            "zarr_format": 3, "node_type": "array", "shape": [214748648, 14, 16], "data_type": "uint16", "fill_value": 0,
            "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": [16, 16, 16]}},
            "chunk_key_encoding": {"name": "default"}, "codecs": [{"name": "bytes", "configuration": {"endian": "little"}}],
            "attributes": {}}))
        self.refused("convert", store, "o.vdb")

    def test_a_grid_of_tiles(self):
        import pyopenvdb as vdb
        grid = vdb.FloatGrid(3.0)
        grid.name, grid.gridClass = "band", vdb.GridClass.LEVEL_SET
        grid.fill((0, 0, 0), (4095, 4095, 4095), -3.0, True)
        grid.fill((8192, 0, 0), (8195, 3, 3), -3.0, True)
        vdb.write(str(self.inputs / "tiles.vdb"), grids=[grid])
        tiles = self.inputs / "tiles.vdb"
        self.assertLess(tiles.stat().st_size, 20000)
        self.refused("evolve", tiles, "-o", "o.vdb", "--rho", 0, "--theta", 0)
        self.refused("convert", tiles, "o.nrrd")
        self.refused("segment", tiles, "--points", self.points, "-o", "o.vdb")

    def test_thin_voxels(self):
        path = self.inputs / "thin.nrrd"
        write_nrrd(path, (16, 14, 12), bytes(range(16)) * 14 * 12)
        text = path.read_bytes().replace(b"(0.5,0,0)", b"(0.0006,0,0)").replace(b"(0,0.5,0)", b"(0,2.5,0)")
        path.write_bytes(text.replace(b"(0,0,0.5)", b"(0,0,2.5)"))
        self.refused("convert", path, "o.vdb")
        self.run_covol("convert", path, "o.vdb", "--voxel-size", "0.5")

    def test_archives_of_rois(self):
        path = self.inputs / "one.zip"
        bomb_of_rois(path, 1, 50_000_000)
        self.refused("info", path, expected_text="archive")
        path = self.inputs / "many.zip"
        bomb_of_rois(path, 200, 250_000)
        self.refused("info", path, expected_text="archive")
        bomb_of_rois(path, 3, 1000)
        self.assertIn("3000 points", self.run_covol("info", path).stdout)

    def test_an_archive_that_lies_of_a_size(self):
        path = self.inputs / "lie.zip"
        bomb_of_rois(path, 1, 2_000_000)
        data = path.read_bytes()
        size = struct.pack("<I", 64 + 4 * 2_000_000)
        path.write_bytes(data.replace(size, struct.pack("<I", 1000)))
        self.refused("info", path, expected_text="damaged")

    def test_an_image_that_does_not_fit(self):
        self.run_covol("phantom", "sphere", "--size", 160, "-o", self.inputs / "b.tif")
        for words in (["info", self.inputs / "b.tif"], ["convert", self.inputs / "b.tif", "o.vdb"],
                      ["compare", self.inputs / "b.tif", self.inputs / "b.tif"], ["check", self.inputs / "b.tif"]):
            with self.subTest(words[0]):
                code, _, text = self.peak(*words, "--quiet", "--memory-limit", "3M")
                self.assertEqual(code, 3, text)
                self.assertIn("memory", text)


class Places(Case):
    """Lattices that floating-point numbers cannot represent well are refused in every format."""

    def test_spacings_and_origins(self):
        import nibabel
        for spacing, origin, expected_text in ((1e26, 0, "spacing"), (1e-26, 0, "spacing"), (1, 1.8e19, "origin"), (1e-3, 1e10, "origin")):
            with self.subTest((spacing, origin)):
                path = self.inputs / "i.nrrd"
                write_nrrd(path, (4, 4, 4), bytes(64), spacing=spacing, origin=(origin, 0, 0))
                self.refuse("info", path, code=3, expected_text=expected_text)
                path = self.inputs / "i.mha"
                path.write_bytes((f"ObjectType = Image\nNDims = 3\nDimSize = 4 4 4\nElementSpacing = {spacing} {spacing} {spacing}\n"
                                  f"Offset = {origin} 0 0\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n").encode() + bytes(64))
                self.refuse("info", path, code=3, expected_text=expected_text)
                path = self.inputs / "i.nii"
                affine = np.diag([spacing, spacing, spacing, 1.0])
                affine[0, 3] = origin
                nibabel.save(nibabel.Nifti1Image(np.zeros((4, 4, 4), np.uint8), affine), path)
                self.run_covol("info", path, code=3)
        self.refuse("info", self.image, "--spacing", "1e26,1,1", code=3, expected_text="spacing")

    def test_grids(self):
        import pyopenvdb as vdb
        for size, origin, expected_text in ((1e26, 0, "voxels up to"), (1, 1e11, "origin"), (1, 1000, "")):
            with self.subTest((size, origin)):
                grid = vdb.FloatGrid(0.0)
                grid.name = "u"
                grid.fill((0, 0, 0), (3, 3, 3), 1.0)
                grid.transform = vdb.createLinearTransform([[size, 0, 0, 0], [0, size, 0, 0], [0, 0, size, 0], [origin, 0, 0, 1]])
                path = self.inputs / "grid.vdb"
                vdb.write(str(path), grids=[grid])
                if expected_text:
                    self.refuse("convert", path, "o.nrrd", code=3, expected_text=expected_text)
                else:
                    self.run_covol("convert", path, "o.nrrd")

    def test_far_places_that_numbers_hold(self):
        # (spacing, origin): 1 mm voxels in a national grid in metres, 5 nm voxels 0.1 m along a stage, and a large
        # scale.
        for spacing, origin in ((1e-3, 4.2e6), (5e-9, 0.1), (300.0, 1e9)):
            write_nrrd(self.inputs / "i.nrrd", (4, 4, 4), bytes(64), spacing=spacing, origin=(origin, 0, 0))
            self.run_covol("info", self.inputs / "i.nrrd")


class LargeImages(Limited):
    """2048^3 bytes, of which the file system stores only those around a ball."""

    SIZE, RADIUS = 2048, 40

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        n, r = cls.SIZE, cls.RADIUS
        cls.large = cls.inputs / "large.nrrd"
        header = (f"NRRD0004\ntype: uint8\ndimension: 3\nspace: left-posterior-superior\nsizes: {n} {n} {n}\n"
                  "space directions: (1,0,0) (0,1,0) (0,0,1)\nencoding: raw\nspace origin: (0,0,0)\n\n").encode()
        axis = np.arange(-r - 3, r + 4)
        first = n // 2 + axis[0]
        x, y = np.meshgrid(axis, axis, indexing="xy")
        with open(cls.large, "wb") as file:
            file.write(header)
            file.truncate(len(header) + n ** 3)
            for z in axis:
                slice_ = np.clip(100 * (r + 0.5 - np.sqrt(x * x + y * y + z * z)), 0, 200).astype(np.uint8)
                for j, row in enumerate(slice_):
                    file.seek(len(header) + ((n // 2 + int(z)) * n + first + j) * n + first)
                    file.write(row.tobytes())
        golden = np.pi * (3 - np.sqrt(5)) * np.arange(400)
        height = 1 - (2 * np.arange(400) + 1) / 400
        ring = np.sqrt(1 - height ** 2)
        np.savetxt(cls.inputs / "large.xyz", n // 2 + r * np.column_stack([ring * np.cos(golden), ring * np.sin(golden), height]))

    def test_info_looks_at_a_part(self):
        output = self.run_covol("info", self.large, "--json", "r.json").stdout
        self.assertIn("0 to 200", output)
        self.assertIn("an estimate", output)
        self.assertTrue(json.loads((self.out / "r.json").read_text())["image"]["range_is_estimate"])
        self.assertNotIn("estimate", self.run_covol("info", self.image).stdout)

    def test_plan_knows_of_mapped_pages(self):
        # The bounds of `ratio` are wide, because the peak of memory depends on earlier runs: if the system still has
        # pages of the image in memory, it maps more of them at once. docs/benchmarks_speed.md states how accurate plans are.
        job = ["segment", self.large, "--points", self.inputs / "large.xyz", "-o", "s.vdb", "--quiet", "--json"]
        self.run_covol("plan", *job, "plan.json")
        planned = json.loads((self.out / "plan.json").read_text())["plan"]
        self.assertGreater(planned["mapped_bytes"], 10 * MIB)
        self.run_covol(*job, "job.json")
        ratio = planned["memory_bytes"] / json.loads((self.out / "job.json").read_text())["peak_rss_bytes"]
        self.assertGreater(ratio, 0.75)
        self.assertLess(ratio, 1.5)


del Limited, Case  # base classes: unittest would run them, too


if __name__ == "__main__":
    unittest.main()
