"""HDF5 files that h5py wrote in the layouts of Imaris, BigDataViewer and ilastik, compared voxel by voxel.

    cd tests/cli && COVOL=../../build/bin/covol python3 -m unittest hdf5_test
"""
import json
import math
import struct
import subprocess
import unittest

import zarr_test
from covol_case import COVOL
from zarr_test import CHUNKS, SHAPE, ball, pixels, write_marks

try:
    import h5py
    import numcodecs
    import numpy as np
    MISSING = zarr_test.MISSING
except ImportError as error:
    MISSING = f"SKIPPED: {error}; see tests/install_packages.sh"


class Case(zarr_test.Case):
    def file(self, name="a.h5", **how):
        return h5py.File(self.path(name), "w", **how)

    def error(self, path, *options):
        return self.run_covol("info", path, *options, code=3).stderr

    def info_of(self, path, *options):
        return self.report("info", path, *options)["image"]


def means(data):
    """Means of 2 x 2 x 2 voxels; an odd one at the end is ignored."""
    n = [s // 2 * 2 for s in data.shape]
    d = data[:n[0], :n[1], :n[2]].astype(float)
    return d.reshape(n[0] // 2, 2, n[1] // 2, 2, n[2] // 2, 2).mean((1, 3, 5)).astype(data.dtype)


def letters(text):
    return np.array([c.encode() for c in str(text)], dtype="S1")


@unittest.skipIf(MISSING, MISSING)
class Plain(Case):
    """Datasets in plain HDF5 files."""

    def test_types_and_byte_orders(self):
        kinds = ["u1", "i1", "<u2", ">u2", "<i2", ">i2", "<u4", ">u4", "<i4", ">i4", "<u8", ">u8", "<i8", ">i8", "<f2", ">f2",
                 "<f4", ">f4", "<f8", ">f8"]
        with self.file() as f:
            for kind in kinds:
                f[f"whole/{kind}"] = pixels(kind)
                f.create_dataset(f"chunks/{kind}", data=pixels(kind), chunks=CHUNKS, compression="gzip", shuffle=True)
            f["bool"] = pixels("u1") > 128
        for n, kind in enumerate(kinds):
            for place in ("whole", "chunks") if kind in ("<f2", ">u8") else ("whole", "chunks")[n // 2 % 2:][:1]:
                with self.subTest(kind=kind, place=place):
                    self.check(f"a.h5:/{place}/{kind}", pixels(kind))
        self.check("a.h5:bool", pixels("u1") > 128)
        self.assertEqual(self.info_of("a.h5:/chunks/<f2")["type"], "float")
        self.assertEqual(self.info_of("a.h5:/chunks/>i8")["type"], "double")

    def test_filters(self):
        data = np.sort(pixels("<u2"), axis=2)
        noise = pixels("<u2", seed=3)
        filters = {"none": {}, "gzip": {"compression": "gzip"}, "shuffle": {"shuffle": True},
                   "gzip-shuffle": {"compression": "gzip", "shuffle": True}, "lzf": {"compression": "lzf"},
                   "lzf-shuffle": {"compression": "lzf", "shuffle": True}, "fletcher": {"fletcher32": True, "compression": "gzip"},
                   "szip": {"compression": "szip"}, "offset": {"scaleoffset": 0}}
        with self.file() as f:
            for name, how in filters.items():
                f.create_dataset(name, data=data, chunks=CHUNKS, **how)
                f.create_dataset(name + "-noise", data=noise, chunks=CHUNKS, **how)
                f.create_dataset(name + "-flat", data=np.full(SHAPE, 5, "u1"), chunks=(7, 21, 34), **how)
        for name in filters:
            with self.subTest(name):
                self.check(f"a.h5:/{name}", data)
                self.check(f"a.h5:/{name}-noise", noise)
                self.check(f"a.h5:/{name}-flat", np.full(SHAPE, 5))

    def test_registered_filters(self):
        """Chunks are compressed here and written directly: h5py knows only the numbers of these filters."""
        def lz4(data):
            packed, block = b"", 1000
            for begin in range(0, len(data), block):
                part = data[begin:begin + block]
                small = numcodecs.lz4.compress(part)[4:]
                small = part if len(small) >= len(part) else small
                packed += struct.pack(">I", len(small)) + small
            return struct.pack(">QI", len(data), block) + packed
        data = np.sort(pixels("<u2", (10, 16, 32)), axis=2)
        data[:5, :8, :16] = 0
        packers = {32001: numcodecs.Blosc("lz4", 5, 1).encode, 32015: numcodecs.Zstd(3).encode, 32004: lz4}
        with self.file() as f:
            for number in packers:
                properties = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
                properties.set_chunk(CHUNKS)
                properties.set_filter(number, h5py.h5z.FLAG_OPTIONAL, ())
                space = h5py.h5s.create_simple(data.shape)
                dataset = h5py.h5d.create(f.id, str(number).encode(), h5py.h5t.NATIVE_UINT16, space, properties)
                for z in (0, 5):
                    for y in (0, 8):
                        for x in (0, 16):
                            if (z, y, x) == (0, 0, 0):
                                continue  # this chunk is not written
                            block = np.ascontiguousarray(data[z:z + 5, y:y + 8, x:x + 16])
                            plain = (z, y, x) == (5, 8, 16)
                            dataset.write_direct_chunk((z, y, x), block.tobytes() if plain else bytes(packers[number](block.tobytes())),
                                                       1 if plain else 0)
            properties = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
            properties.set_chunk(CHUNKS)
            properties.set_filter(32008, h5py.h5z.FLAG_OPTIONAL, ())
            h5py.h5d.create(f.id, b"bitshuffle", h5py.h5t.NATIVE_UINT16, h5py.h5s.create_simple(SHAPE), properties)
        for number in packers:
            with self.subTest(number):
                self.check(f"a.h5:/{number}", data)
        self.assertIn("the filter 32008", self.error("a.h5:/bitshuffle"))

    def test_missing_chunks_and_layouts(self):
        expected = np.full(SHAPE, 7)
        expected[5:10, 8:16, 16:32] = 3
        with self.file() as f:
            f.create_dataset("chunks", SHAPE, "u1", chunks=CHUNKS, fillvalue=7, compression="gzip")[5:10, 8:16, 16:32] = 3
            f.create_dataset("empty", SHAPE, "f4", fillvalue=-2.5)
            f.create_dataset("nothing", SHAPE, "i2", chunks=CHUNKS)
            f.create_dataset("nan", SHAPE, "f4", chunks=CHUNKS, fillvalue=math.nan)[:5] = 1
            properties = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
            properties.set_layout(h5py.h5d.COMPACT)
            dataset = h5py.h5d.create(f.id, b"compact", h5py.h5t.NATIVE_UINT8, h5py.h5s.create_simple(SHAPE), properties)
            dataset.write(h5py.h5s.ALL, h5py.h5s.ALL, pixels("u1"))
        self.check("a.h5:/chunks", expected)
        self.check("a.h5:/empty", np.full(SHAPE, -2.5))
        self.check("a.h5:/nothing", np.zeros(SHAPE))
        self.check("a.h5:/compact", pixels("u1"))
        self.assertIn("a fill value that is not finite", self.error("a.h5:/nan"))

    def test_a_user_block_and_old_and_new_formats(self):
        for n, version in enumerate(("earliest", "latest")):
            with self.file(f"{version}.h5", userblock_size=1024, libver=version) as f:
                f["whole"] = pixels("u1")
                f.create_dataset("chunks", data=pixels("u1"), chunks=CHUNKS)
                f.create_dataset("one", data=pixels("u1"), chunks=SHAPE, compression="gzip")
                f.create_dataset("more", data=pixels("u1"), chunks=CHUNKS, maxshape=(None,) * (1 + n) + SHAPE[1 + n:])
            for name in ("whole", "chunks", "one", "more"):
                self.check(f"{version}.h5:/{name}", pixels("u1"))

    def test_one_dataset_is_found_and_several_are_listed(self):
        with self.file() as f:
            f["volume/data"] = pixels("u2")
            f["table"] = np.zeros((3, 4))
            f["volume/again"] = h5py.SoftLink("/volume/data")
            f["volume/round"] = f["volume"]
            f["text"] = "words"
        self.check("a.h5", pixels("u2"))
        self.check("a.h5:volume", pixels("u2"))
        self.check("a.h5:/volume/again", pixels("u2"))
        with h5py.File(self.path("a.h5"), "a") as f:
            f["other"] = np.zeros((4, 5, 6))
        error = self.error("a.h5")
        self.assertIn("expected one dataset of three dimensions, got several", error)
        self.assertIn("/other (4 x 5 x 6), /volume/data (13 x 21 x 34)", error)
        self.check("a.h5:/volume", pixels("u2"))
        self.assertIn("the file has no such dataset", self.error("a.h5:/volume/none"))
        with self.file("empty.h5") as f:
            f["flat"] = np.zeros((3, 4))
        self.assertIn("got none", self.error("empty.h5"))

    def test_axes(self):
        def tags(order, step=0.0):
            return json.dumps({"axes": [{"key": c, "typeFlags": 2, "resolution": step if c in "xyz" else 0, "description": ""}
                                        for c in order]})
        data = pixels("u2", (3, *SHAPE, 2))
        with self.file() as f:
            for name, how in (("chunks", {"chunks": (1, *CHUNKS, 2), "compression": "gzip"}), ("whole", {})):
                f.create_dataset(name, data=data, **how).attrs["axistags"] = tags("tzyxc", 0.25)
            f.create_dataset("xyz", data=data[0, ..., 0].transpose(2, 1, 0)).attrs["axistags"] = tags("xyz")
            f.create_dataset("ctzyx", data=np.ascontiguousarray(data.transpose(4, 0, 1, 2, 3))).attrs["axistags"] = tags("ctzyx")
            f.create_dataset("unknown", data=data)
            f.create_dataset("ones", data=data[:1, ..., :1])
            f.create_dataset("labels", data=data[..., 0].transpose(1, 2, 3, 0))
            for n, label in enumerate("zyxt"):
                f["labels"].dims[n].label = label
            f.create_dataset("bad", data=data[0, ..., 0]).attrs["axistags"] = "{"
            f.create_dataset("twice", data=data[0, ..., 0]).attrs["axistags"] = tags("zyy")
            f.create_dataset("few", data=data[0, ..., 0]).attrs["axistags"] = tags("zy")
        for name in ("chunks", "whole", "ctzyx"):
            for channel in range(2):
                self.check(f"a.h5:/{name}", data[2, ..., channel], "--channel", channel, "--frame", 2)
        info = self.info_of("a.h5:/whole")
        self.assertEqual((info["channels"], info["frames"], info["axis_order"], info["spacing"]), (2, 3, "CXYZT", [0.25] * 3))
        self.check("a.h5:/xyz", data[0, ..., 0])
        self.check("a.h5:/ones", data[0, ..., 0])
        self.check("a.h5:/labels", data[1, ..., 0], "--frame", 1)
        self.assertIn("got a dataset of 3 x 13 x 21 x 34 x 2 without it", self.error("a.h5:/unknown"))
        self.assertIn("it is not valid JSON", self.error("a.h5:/bad"))
        self.assertIn("expected axes z, y and x", self.error("a.h5:/twice"))
        self.assertIn("expected axistags for each of its 3", self.error("a.h5:/few"))

    def test_spacing(self):
        with self.file() as f:
            f["none"] = pixels("u1")
            for name, attributes in {"element": {"element_size_um": [3.0, 2.0, 1.0]}, "spacing": {"spacing": [3, 2, 1], "unit": "mm"},
                                     "resolution": {"resolution": np.float32([30, 4, 4]), "units": "nanometer"},
                                     "odd": {"spacing": [3.0, -1.0, math.nan]}, "few": {"spacing": [1.0, 2.0]},
                                     "text": {"spacing": "3 2 1"}}.items():
                f[name] = pixels("u1")
                f[name].attrs.update(attributes)
        for name, spacing, unit in (("element", [1, 2, 3], "um"), ("spacing", [1, 2, 3], "mm"), ("resolution", [4, 4, 30], "nm")):
            info = self.info_of(f"a.h5:/{name}")
            self.assertEqual((info["spacing"], info["unit"], info["spacing_known"]), (spacing, unit, [True] * 3))
        for name in ("none", "odd", "few", "text"):
            self.assertIn("states no spacing along x, y, z", self.run_covol("info", f"a.h5:/{name}").stderr)

    def test_refused(self):
        with self.file("b.h5") as f:
            f["data"] = pixels("u1")
        self.path("raw").write_bytes(pixels("u1").tobytes())
        with self.file() as f:
            f["compound"] = np.zeros(SHAPE, [("r", "u1"), ("g", "u1")])
            f["complex"] = np.zeros(SHAPE, "c8")
            f["text"] = np.full(SHAPE, b"a", "S1")
            f["external"] = h5py.ExternalLink("b.h5", "/data")
            f["group/external"] = h5py.ExternalLink("b.h5", "/")
            f["soft"] = h5py.SoftLink("/group/external/data")
            f.create_dataset("raw", SHAPE, "u1", external=[("raw", 0, h5py.h5f.UNLIMITED)])
            virtual = h5py.VirtualLayout(SHAPE, "u1")
            virtual[...] = h5py.VirtualSource("b.h5", "data", SHAPE)
            f.create_virtual_dataset("virtual", virtual)
            f.create_dataset("large", (1 << 31, 4, 4), "u1", chunks=(1024, 4, 4))
            f.create_dataset("many", (1 << 30, 1 << 30, 4), "u1", chunks=(1024, 4, 4))
            f.create_dataset("chunk", (2000, 2000, 2000), "f4", chunks=(1000, 1000, 1000))
            f["flat"] = np.zeros((3, 4))
            f["zero"] = np.zeros((0, 3, 4))
            f["cube"] = np.zeros((2, 2, 2))
        for name, word in {"compound": "records of several values", "complex": "records of several values", "text": "texts",
                           "external": "/external is a link into another file", "group/external/data": "link into another file",
                           "soft": "a.h5:/soft: the file has no such dataset", "raw": "lie in other files",
                           "virtual": "lie in other files", "large": "claims", "many": "claims", "chunk": "1 GiB at most",
                           "flat": "got a dataset of 3 x 4", "zero": "expected a 3D image", "group": "expected a dataset"}.items():
            with self.subTest(name):
                self.assertIn(word, self.error(f"a.h5:/{name}"))
        listed = self.error("a.h5")
        self.assertNotIn("external", listed)
        self.assertNotIn("/data", listed)

    def test_cut_and_damaged(self):
        """Every truncation and many flipped bytes give an error or another grey value, and never a crash."""
        with self.file() as f:
            f.create_dataset("data", data=pixels("<u2"), chunks=CHUNKS, compression="gzip", shuffle=True)
        good = self.path("a.h5").read_bytes()
        rng = np.random.default_rng(5)
        failures = 0
        cuts = [good[:len(good) * n // 8] for n in range(8)]
        places = np.concatenate([rng.integers(0, len(good), 8), rng.integers(0, 2048, 24)])
        flips = [good[:p] + bytes([good[p] ^ 1 << int(rng.integers(8))]) + good[p + 1:] for p in places]
        # For some damaged headers, the HDF5 library keeps objects open, and would print errors about them at the
        # program's exit. Only messages of covol may be printed.
        header = [good[:p] + bytes([good[p] ^ 128]) + good[p + 1:] for p in range(800, 832)]
        for n, bad in enumerate(cuts + flips + header):
            self.path("bad.h5").write_bytes(bad)
            done = subprocess.run([COVOL, "info", "bad.h5", "--quiet"], capture_output=True, text=True, cwd=self.folder, timeout=60)
            self.assertIn(done.returncode, (0, 3), f"{n}: {done.stderr}")
            self.assertEqual([line for line in done.stderr.splitlines() if not line.startswith("covol: ")], [], n)
            if n < len(cuts):
                self.assertEqual(done.returncode, 3)
            failures += done.returncode == 3
        self.assertGreater(failures, len(cuts) + 3)

    def test_itk_layout_still_reads(self):
        script = "itk.h5"
        with self.file(script) as f:
            f["ITKVersion"] = "5.2.1"
            f["HDFVersion"] = "1.10.8"
            image = f.create_group("ITKImage/0")
            image["Dimension"] = np.array(SHAPE[::-1], "u8")
            image["Spacing"] = np.array([1.0, 2.0, 3.0])
            image["Origin"] = np.array([4.0, 5.0, 6.0])
            image["Directions"] = np.eye(3)
            image["VoxelType"] = "USHORT"
            image["VoxelData"] = pixels("u2")
            f.create_group("ITKImage/0/MetaData")
        info = self.info_of(script)
        self.assertEqual((info["format"], info["spacing"], info["origin"]), ("HDF5 (ITK's layout)", [1, 2, 3], [4, 5, 6]))
        self.check(script, pixels("u2"))
        self.check("itk.h5:/ITKImage/0/VoxelData", pixels("u2"))


@unittest.skipIf(MISSING, MISSING)
class Imaris(Case):
    """https://imaris.oxinst.com/support/imaris-file-format"""

    def write(self, name="a.ims", shape=SHAPE, kind="u2", channels=2, times=2, levels=3, low=(10.0, -20.0, 4.0), step=(0.5, 0.5, 2.0)):
        """@returns the finest data by time and channel."""
        data = {}
        with self.file(name) as f:
            f.attrs["ImarisDataSet"] = letters("ImarisDataSet")
            f.attrs["DataSetInfoDirectoryName"] = letters("DataSetInfo")
            info = f.create_group("DataSetInfo/Image").attrs
            for a, axis in enumerate("XYZ"):
                info[axis] = letters(shape[2 - a])
                info[f"ExtMin{a}"] = letters(low[a])
                info[f"ExtMax{a}"] = letters(low[a] + step[a] * shape[2 - a])
            info["Unit"] = letters("um")
            for c in range(channels):
                f.create_group(f"DataSetInfo/Channel {c}").attrs["Name"] = letters(f"stain {c}")
            f.create_dataset("Thumbnail/Data", data=np.zeros((256, 1024), "u1"))
            for t in range(times):
                for c in range(channels):
                    level = data[t, c] = pixels(kind, shape, 10 * t + c)
                    for r in range(levels):
                        group = f.create_group(f"DataSet/ResolutionLevel {r}/TimePoint {t}/Channel {c}")
                        for a, axis in enumerate("XYZ"):
                            group.attrs[f"ImageSize{axis}"] = letters(level.shape[2 - a])
                        padded = np.zeros([-(-s // n) * n for s, n in zip(level.shape, CHUNKS)], kind)
                        padded[tuple(map(slice, level.shape))] = level
                        group.create_dataset("Data", data=padded, chunks=CHUNKS, compression="gzip")
                        group.create_dataset("Histogram", data=np.zeros(256, "u8"))
                        level = means(level)
        return data

    def test_image(self):
        for kind in ("u1", "u2", "f4"):
            data = self.write(kind=kind)
            info = self.info_of("a.ims")
            self.assertEqual((info["format"], info["size"], info["channels"], info["frames"], info["axis_order"]),
                             ("Imaris", [34, 21, 13], 2, 2, "XYZCT"))
            self.assertEqual((info["spacing"], info["origin"], info["unit"]), ([0.5, 0.5, 2], [10.25, -19.75, 5], "um"))
            self.assertEqual((info["channel_names"], info["chunk_size"]), (["stain 0", "stain 1"], [16, 8, 5]))
            for (t, c), expected in data.items():
                self.check("a.ims", expected, "--channel", c, "--frame", t)
        self.assertIn("expected one channel, got 2; choose 0 (stain 0), 1 (stain 1)",
                      self.run_covol("convert", "a.ims", "x.vdb", code=3).stderr)

    def test_levels(self):
        data = self.write()
        info = self.info_of("a.ims")
        self.assertEqual(info["levels"], ["/DataSet/ResolutionLevel 0: 34 x 21 x 13, spacing 0.5 x 0.5 x 2",
                                          "/DataSet/ResolutionLevel 1: 17 x 10 x 6, spacing 1 x 1 x 4",
                                          "/DataSet/ResolutionLevel 2: 8 x 5 x 3, spacing 2 x 2 x 8"])
        path = "a.ims:/DataSet/ResolutionLevel 1"
        info = self.info_of(path)
        # The first voxel of resolution level 1 covers two voxels of level 0 along each axis; the origin is its centre.
        self.assertEqual((info["spacing"], info["origin"]), ([1, 1, 4], [10.5, -19.5, 6]))
        self.check(path, means(data[1, 0]), "--channel", 0, "--frame", 1)
        self.check(path + "/TimePoint 1", means(data[1, 0]), "--channel", 0)
        self.check(path + "/TimePoint 1/Channel 1", means(data[1, 1]))
        self.check(path + "/TimePoint 1/Channel 1/Data", means(data[1, 1]))
        self.check("a.ims:DataSet/ResolutionLevel 2/TimePoint 0/Channel 0/Data", means(means(data[0, 0])))
        self.assertEqual(self.info_of("a.ims:DataSet/ResolutionLevel 2/TimePoint 0/Channel 1/Data")["channel_names"], ["stain 1"])
        self.assertIn("the file has no such dataset", self.error("a.ims:/DataSet/ResolutionLevel 7"))

    def test_damaged(self):
        def change(edit):
            self.write(channels=1, times=1)
            with h5py.File(self.path("a.ims"), "a") as f:
                edit(f)
        channel = "DataSet/ResolutionLevel 0/TimePoint 0/Channel 0"

        def larger(f):
            f[channel].attrs["ImageSizeX"] = letters(4000)

        def flat(f):
            f[channel].attrs["ImageSizeX"] = letters(1)

        def missing(f):
            del f[channel + "/Data"]

        def group(f):
            del f[channel + "/Data"]
            f.create_group(channel + "/Data")
        for edit, word in ((larger, "as its attributes state"), (flat, "expected a 3D image"), (missing, "no such dataset"),
                           (group, "expected 3 dimensions")):
            change(edit)
            self.assertIn(word, self.error("a.ims"))

        def no_extent(f):
            del f["DataSetInfo/Image"].attrs["ExtMax1"]
        change(no_extent)
        self.assertIn("states no spacing", self.run_covol("info", "a.ims").stderr)

    def test_same_volume_from_a_level(self):
        """A ball: the finest level and the next give surfaces at the same position."""
        n, radius, centre = 64, 18, 31.5
        voxels = ball(centre, radius, 0, n)
        with self.file("ball.ims") as f:
            info = f.create_group("DataSetInfo/Image").attrs
            for a in range(3):
                info[f"ExtMin{a}"], info[f"ExtMax{a}"] = letters(0), letters(n)
            for level, data in enumerate((voxels, means(voxels))):
                group = f.create_group(f"DataSet/ResolutionLevel {level}/TimePoint 0/Channel 0")
                group.create_dataset("Data", data=data, chunks=(16, 16, 16), compression="gzip")
        write_marks(self.path("marks.xyz"), centre + 0.5, radius)
        for path in ("ball.ims", "ball.ims:/DataSet/ResolutionLevel 1"):
            surface = self.report("segment", path, "--points", "marks.xyz", "-o", "ball.vdb")["surface"]
            self.assertAlmostEqual(surface["volume"] / (4 / 3 * math.pi * radius ** 3), 1, delta=0.05)


@unittest.skipIf(MISSING, MISSING)
class BigDataViewer(Case):
    """https://imagej.net/plugins/bdv/"""

    def write(self, setups=(SHAPE, SHAPE), times=(0, 3), voxel=("0.4 0.5 2.0", "0.4 0.5 2.0"), unit="micrometer", xml=True):
        data = {}
        with self.file("b.h5") as f:
            for s, shape in enumerate(setups):
                f[f"s{s:02d}/resolutions"] = np.array([[1.0, 1, 1], [2, 2, 2]])
                f[f"s{s:02d}/subdivisions"] = np.array([CHUNKS[::-1]] * 2, "i4")
                for t in times:
                    values = data[t, s] = pixels("u2", shape, 10 * t + s) + np.uint16(40000)
                    for level, stored in enumerate((values, means(values))):
                        f.create_dataset(f"t{t:05d}/s{s:02d}/{level}/cells", data=stored.astype("u2").view("i2"), chunks=tuple(map(min, CHUNKS, stored.shape)),
                                         compression="gzip")
            f["__DATA_TYPES__/Enum_Boolean"] = 1
        setup = "".join(f"<ViewSetup><id>{s}</id><name>view {s} &amp; more</name><size>{' '.join(map(str, shape[::-1]))}</size>"
                        f"<voxelSize><unit>{unit}</unit><size>{voxel[s]}</size></voxelSize>"
                        f"<attributes><channel>{s}</channel></attributes></ViewSetup>" for s, shape in enumerate(setups))
        if xml:
            self.path("b.xml").write_text('<?xml version="1.0"?><SpimData version="0.2"><!-- a > b --><BasePath type="relative">.</BasePath>'
                                          '<SequenceDescription><ImageLoader format="bdv.hdf5"><hdf5 type="relative">b.h5</hdf5></ImageLoader>'
                                          f"<ViewSetups>{setup}</ViewSetups></SequenceDescription></SpimData>")
        return data

    def test_image(self):
        data = self.write()
        info = self.info_of("b.h5")
        self.assertEqual((info["format"], info["type"], info["channels"], info["frames"]), ("BigDataViewer HDF5", "uint16", 2, 2))
        self.assertEqual((info["spacing"], info["origin"], info["unit"], info["size"]), ([0.4, 0.5, 2], [0, 0, 0], "um", [34, 21, 13]))
        self.assertEqual(info["channel_names"], ["view 0 & more", "view 1 & more"])
        self.assertEqual(info["levels"], ["/t00000/s00/0/cells: 34 x 21 x 13, spacing 0.4 x 0.5 x 2",
                                          "/t00000/s00/1/cells: 17 x 10 x 6, spacing 0.8 x 1 x 4"])
        for n, t in enumerate((0, 3)):
            for c in range(2):
                self.check("b.h5", data[t, c], "--channel", c, "--frame", n)
        self.check("b.h5:/t00003/s01", data[3, 1])
        self.check("b.h5:/t00003", data[3, 1], "--channel", 1)

    def test_levels(self):
        data = self.write()
        info = self.info_of("b.h5:/t00003/s01/1/cells")
        self.assertEqual((info["spacing"], info["origin"]), ([0.8, 1, 4], [0.2, 0.25, 1]))
        self.check("b.h5:/t00003/s01/1/cells", means(data[3, 1]))
        self.assertIn("no such dataset", self.error("b.h5:/t00003/s01/7/cells"))

    def test_without_xml(self):
        data = self.write(xml=False)
        self.assertIn("states no spacing", self.run_covol("info", "b.h5").stderr)
        self.check("b.h5:/t00000/s00", data[0, 0])
        self.path("b.xml").write_text("<ViewSetup><id>0</id><voxelSize><size>1 2")
        self.assertIn("states no spacing", self.run_covol("info", "b.h5").stderr)

    def test_setups_that_differ(self):
        data = self.write(setups=(SHAPE, (9, 10, 11)))
        self.assertIn("b.h5:/t00000/s00 (34 x 21 x 13), b.h5:/t00000/s01 (11 x 10 x 9)", self.error("b.h5"))
        self.check("b.h5:/t00000/s01", data[0, 1])
        self.write(voxel=("1 1 1", "2 2 2"))
        self.assertIn("expected setups of one voxel size", self.error("b.h5"))
        self.assertEqual(self.info_of("b.h5:/t00000/s01")["spacing"], [2, 2, 2])
        self.write()
        with h5py.File(self.path("b.h5"), "a") as f:
            del f["t00003/s01"]
        self.assertIn("/t00003/s01/0/cells: the file has no such dataset",
                      self.run_covol("convert", "b.h5", "x.vdb", "--channel", 1, "--frame", 1, code=3).stderr)


@unittest.skipIf(MISSING, MISSING)
class Large(Case):
    """From 256 MiB on, chunks are read on demand, and contiguous data is mapped."""

    def test_a_ball_in_a_large_dataset(self):
        n, centre, radius = 1024, 500, 30
        low, high = centre - 40, centre + 40
        places = {"gzip": {"chunks": (64,) * 3, "compression": "gzip"}, "checked": {"chunks": (64,) * 3, "fletcher32": True},
                  "mapped": {}, "swapped": {}}
        with self.file() as f:
            for name, how in places.items():
                dataset = f.create_dataset(name, (n, n, n), ">u2" if name == "swapped" else "u1", **how)
                dataset.attrs["element_size_um"] = [1.0, 1.0, 1.0]
                dataset[low:high, low:high, low:high] = ball(centre, radius, low, high)
        write_marks(self.path("marks.xyz"), centre, radius)
        volumes = set()
        for name in places:
            with self.subTest(name):
                report = self.report("segment", f"a.h5:/{name}", "--points", "marks.xyz", "-o", "ball.vdb")
                volumes.add(round(report["surface"]["volume"], 3))
                chunks = report["input"]["image"].get("chunks")
                if name == "mapped":
                    self.assertIsNone(chunks)
                else:
                    self.assertEqual((chunks["size"], chunks["of"]), ([64] * 3, 16 ** 3))
                    self.assertLess(chunks["read"], 200)
                self.assertLess(report["peak_rss_bytes"], 700e6)
        self.assertEqual(len(volumes), 1)
        self.assertAlmostEqual(volumes.pop() / (4 / 3 * math.pi * radius ** 3), 1, delta=0.03)
