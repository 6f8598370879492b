"""OME-Zarr and Zarr: stores of zarr-python, and of a writer of Zarr 3 made from its specification, compared voxel by voxel.

    COVOL=build/bin/covol python3 -m unittest tests/cli/zarr_test.py
"""
import itertools
import json
import math
import shutil
import struct
import unittest

import covol_case

try:
    import numcodecs
    import numpy as np
    import pyopenvdb
    import zarr
    MISSING = ""
except ImportError as error:
    MISSING = f"SKIPPED: {error}; see tests/install_packages.sh"

SHAPE = (13, 21, 34)   # z, y, x; not multiples of CHUNKS, so that chunks at the ends are only partly used
CHUNKS = (5, 8, 16)


def pixels(kind, shape=SHAPE, seed=1):
    """Random numbers that are exact in 32-bit floats."""
    rng = np.random.default_rng(seed)
    dtype = np.dtype(kind)
    if dtype.kind == "f":
        return (rng.integers(-1000, 1000, shape) / 8).astype(dtype)
    info = np.iinfo(dtype)
    return rng.integers(max(info.min, -(1 << 23)), min(info.max, 1 << 23), shape).astype(dtype)


def crc32c(data, table=[]):
    """RFC 3720, appendix B.4."""
    if not table:
        for n in range(256):
            for _ in range(8):
                n = n >> 1 ^ (0x82F63B78 if n & 1 else 0)
            table.append(n)
    value = 0xFFFFFFFF
    for byte in data:
        value = table[(value ^ byte) & 255] ^ value >> 8
    return struct.pack("<I", value ^ 0xFFFFFFFF)


def pack(data, codecs):
    for codec in codecs:
        name = codec["name"]
        if name == "gzip":
            data = numcodecs.GZip(5).encode(data)
        elif name == "zstd":
            data = numcodecs.Zstd(3).encode(data)
        elif name == "blosc":
            data = numcodecs.Blosc("zstd", 5, numcodecs.Blosc.SHUFFLE).encode(np.frombuffer(data, np.uint16))
        elif name == "crc32c":
            data = bytes(data) + crc32c(data)
        data = bytes(data)
    return data


def write_zarr3(folder, array, chunk, codecs=(), big=False, order=None, shard=None, index_location="end", checked=True,
                key="default", separator=None, skip=(), fill=0, names=None):
    """Zarr 3 core and its codecs, by the specification. `skip`: positions of chunks that are not written."""
    folder.mkdir(parents=True)
    endian = "big" if big else "little"
    stored = array.astype(array.dtype.newbyteorder(">" if big else "<"))
    chain = [{"name": "transpose", "configuration": {"order": list(order)}}] if order else []
    chain += [{"name": "bytes", "configuration": {"endian": endian}}, *codecs]

    def encode(place):
        begin = [p * c for p, c in zip(place, chunk)]
        block = np.full(chunk, fill, stored.dtype)
        part = stored[tuple(slice(b, b + c) for b, c in zip(begin, chunk))]
        block[tuple(slice(0, n) for n in part.shape)] = part
        return pack((block.transpose(order) if order else block).tobytes(), codecs)

    separator = separator or ("/" if key == "default" else ".")

    def path_of(place):
        path = folder / separator.join((["c"] if key == "default" else []) + [str(p) for p in place])
        path.parent.mkdir(parents=True, exist_ok=True)
        return path
    counts = [-(-n // c) for n, c in zip(array.shape, chunk)]
    outer = chunk
    if not shard:
        for place in itertools.product(*map(range, counts)):
            if place not in skip:
                path_of(place).write_bytes(encode(place))
    else:
        outer = [c * s for c, s in zip(chunk, shard)]
        index_codecs = [{"name": "bytes", "configuration": {"endian": "little"}}]
        index_codecs += [{"name": "crc32c"}] if checked else []
        chain = [{"name": "sharding_indexed", "configuration": {
            "chunk_shape": list(chunk), "codecs": chain, "index_codecs": index_codecs, "index_location": index_location}}]
        for at in itertools.product(*(range(-(-n // s)) for n, s in zip(counts, shard))):
            size = 16 * math.prod(shard) + (4 if checked else 0)
            index, body, begin = b"", b"", size if index_location == "start" else 0
            for inner in itertools.product(*map(range, shard)):
                place = tuple(a * s + i for a, s, i in zip(at, shard, inner))
                if place in skip or any(p >= c for p, c in zip(place, counts)):
                    index += b"\xff" * 16
                    continue
                data = encode(place)
                index += struct.pack("<QQ", begin + len(body), len(data))
                body += data
            if not body:
                continue
            index += crc32c(index) if checked else b""
            path_of(at).write_bytes(index + body if index_location == "start" else body + index)
    meta = {"zarr_format": 3, "node_type": "array", "shape": list(array.shape), "data_type": array.dtype.name,
            "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": list(outer)}},
            "chunk_key_encoding": {"name": key, "configuration": {"separator": separator}},
            "fill_value": fill, "codecs": chain, "attributes": {}}
    if names:
        meta["dimension_names"] = names
    (folder / "zarr.json").write_text(json.dumps(meta))


def axes(names, unit="micrometer"):
    kinds = {"t": "time", "c": "channel"}
    return [{"name": n, "type": kinds.get(n, "space"), **({} if n in "tc" else {"unit": unit})} for n in names]


def dataset(path, scale, translation=None):
    steps = [{"type": "scale", "scale": list(scale)}]
    return {"path": path, "coordinateTransformations":
            steps + ([{"type": "translation", "translation": list(translation)}] if translation else [])}


def ball(centre, radius, low, high):
    """Grey values of a ball at the voxels low..high-1 of a cube."""
    i = np.arange(low, high) - centre
    r = np.sqrt(i[:, None, None] ** 2 + i[None, :, None] ** 2 + i[None, None, :] ** 2)
    return (200 * np.clip(radius - r + 0.5, 0, 1)).astype(np.uint8)


def write_marks(path, centre, radius, count=100):
    """Points evenly spread on a sphere."""
    golden = math.pi * (3 - math.sqrt(5))
    lines = []
    for m in range(count):
        z = 1 - (2 * m + 1) / count
        s = math.sqrt(1 - z * z)
        lines.append(" ".join(f"{centre + radius * v:.5f}" for v in (s * math.cos(golden * m), s * math.sin(golden * m), z)))
    path.write_text("\n".join(lines) + "\n")


@unittest.skipIf(MISSING, MISSING)
class Case(covol_case.Case):
    def setUp(self):
        super().setUp()
        self.folder = self.out

    def read(self, path, *options):
        """The voxels that covol reads, z, y, x."""
        self.run_covol("convert", path, "voxels.vdb", "--spacing", "1,1,1", "--quiet", *options)
        grid = pyopenvdb.readAllGridMetadata(str(self.folder / "voxels.vdb"))[0].name
        grid = pyopenvdb.read(str(self.folder / "voxels.vdb"), grid)
        low, high = grid.evalActiveVoxelBoundingBox()
        values = np.zeros([h - l + 1 for l, h in zip(low, high)], np.float32)
        grid.copyToArray(values, ijk=low)
        return values.transpose(2, 1, 0)

    def check(self, path, expected, *options):
        np.testing.assert_array_equal(self.read(path, *options), expected.astype(np.float32))

    def path(self, name):
        return self.folder / name


class Version2(Case):
    """zarr-python 2 writes, covol reads."""

    def test_types_orders_and_separators(self):
        for n, kind in enumerate(["|u1", "|i1", "<u2", ">u2", "<i2", ">i2", "<u4", ">u4", "<i4", ">i4", "<f2", ">f2", "<f4",
                                  ">f4", "<f8", ">f8"]):
            with self.subTest(kind):
                path = self.path(f"a{n}")
                order, separator = "CF"[n % 2], "./"[n // 2 % 2]
                array = zarr.open(zarr.DirectoryStore(str(path)) if separator == "." else zarr.NestedDirectoryStore(str(path)),
                                  mode="w", shape=SHAPE, chunks=CHUNKS, dtype=kind, order=order)
                array[:] = pixels(kind)
                meta = json.loads((path / ".zarray").read_text())
                self.assertEqual((meta["dtype"], meta["order"], meta.get("dimension_separator", ".")), (kind, order, separator))
                self.check(path, pixels(kind))

    def test_codecs(self):
        codecs = {"none": None, "zlib": numcodecs.Zlib(), "gzip": numcodecs.GZip(), "zstd": numcodecs.Zstd(),
                  "lz4": numcodecs.LZ4()}
        for name in ("blosclz", "lz4", "lz4hc", "zlib", "zstd"):
            for shuffle in (0, 1, 2):
                codecs[f"blosc-{name}-{shuffle}"] = numcodecs.Blosc(name, shuffle=shuffle)
        for name, codec in codecs.items():
            with self.subTest(name):
                data = np.sort(pixels("<u2"), axis=2)
                zarr.open(str(self.path(name)), mode="w", shape=SHAPE, chunks=CHUNKS, dtype="<u2", compressor=codec)[:] = data
                self.check(name, data)
        for codec in (numcodecs.BZ2(), numcodecs.LZMA()):
            zarr.open(str(self.path("other")), mode="w", shape=SHAPE, chunks=CHUNKS, dtype="u1", compressor=codec)[:] = 1
            self.assertIn(f"got '{codec.codec_id}'", self.run_covol("info", "other", code=3).stderr)
        zarr.open(str(self.path("filtered")), mode="w", shape=SHAPE, dtype="i4", filters=[numcodecs.Delta("i4")])[:] = 1
        self.assertIn("expected no filters, got 'delta'", self.run_covol("info", "filtered", code=3).stderr)

    def test_missing_chunks(self):
        for kind, fill in (("u1", 7), ("<f4", -2.5), ("<i2", None)):
            with self.subTest(kind):
                array = zarr.open(str(self.path(kind)), mode="w", shape=SHAPE, chunks=CHUNKS, dtype=kind, fill_value=fill)
                array[5:10, 8:16, 16:32] = 3
                expected = np.full(SHAPE, fill or 0)
                expected[5:10, 8:16, 16:32] = 3
                self.check(kind, expected)
        array = zarr.open(str(self.path("nan")), mode="w", shape=SHAPE, chunks=CHUNKS, dtype="f4", fill_value=math.nan)
        array[:5] = 1
        self.assertIn("a fill_value that is not finite", self.run_covol("info", "nan", code=3).stderr)

    def test_channels_and_frames(self):
        shape = (3, 2, *SHAPE)
        data = pixels("<u2", shape)
        for name, chunks in (("one", (1, 1, *CHUNKS)), ("many", (2, 2, *CHUNKS))):
            for order in "CF":
                path = name + order
                zarr.open(str(self.path(path)), mode="w", shape=shape, chunks=chunks, dtype="<u2", order=order)[:] = data
                info = self.report("info", path)["image"]
                self.assertEqual((info["channels"], info["frames"], info["axis_order"]), (2, 3, "XYZCT"))
                self.check(path, data[2, 1], "--channel", 1, "--frame", 2)
        self.assertIn("expected one channel, got 2", self.run_covol("convert", "oneC", "x.vdb", code=3).stderr)

    def test_a_plain_array_has_no_spacing(self):
        zarr.open(str(self.path("plain")), mode="w", shape=SHAPE, chunks=CHUNKS, dtype="u1")[:] = pixels("u1")
        self.assertIn("states no spacing along x, y, z", self.run_covol("info", "plain").stderr)
        info = self.report("info", "plain")["image"]
        self.assertEqual((info["format"], info["spacing_known"], info["chunk_size"]), ("Zarr 2", [False] * 3, [16, 8, 5]))
        for shape in ((20, 30), (1, 20, 30), (4, 1, 1, 1, 20, 30, 40)):
            zarr.open(str(self.path("flat")), mode="w", shape=shape, dtype="u1")[:] = 1
            self.run_covol("info", "flat", code=3)
        zarr.open(str(self.path("long")), mode="w", shape=SHAPE, dtype="i8")[:] = 1
        self.assertIn("got elements of type '<i8'", self.run_covol("info", "long", code=3).stderr)


class Version3(Case):
    """Stores of a writer made from the specification, read by covol."""

    CODECS = {"none": [], "gzip": [{"name": "gzip", "configuration": {"level": 5}}],
              "zstd": [{"name": "zstd", "configuration": {"level": 3, "checksum": False}}],
              "blosc": [{"name": "blosc", "configuration": {"cname": "zstd", "clevel": 5, "shuffle": "shuffle", "typesize": 2}}],
              "zstd-crc32c": [{"name": "zstd"}, {"name": "crc32c"}], "crc32c": [{"name": "crc32c"}]}

    def test_codecs(self):
        self.assertEqual(crc32c(b"123456789"), struct.pack("<I", 0xE3069283))  # the published check value of CRC-32C
        data = pixels("uint16")
        for name, codecs in self.CODECS.items():
            with self.subTest(name):
                write_zarr3(self.path(name), data, CHUNKS, codecs)
                self.check(name, data)

    def test_types_keys_and_orders(self):
        for n, kind in enumerate(["uint8", "int8", "uint16", "int16", "uint32", "int32", "float16", "float32", "float64"]):
            with self.subTest(kind):
                data = pixels(kind)
                write_zarr3(self.path(f"a{n}"), data, CHUNKS, big=n % 2 == 1, key=("default", "v2")[n % 2],
                            separator="/."[n // 2 % 2], order=(None, (2, 1, 0), (1, 2, 0))[n % 3])
                self.check(f"a{n}", data)

    def test_missing_chunks(self):
        data = pixels("float32")
        data[5:10, :8, 16:32] = 2.5
        write_zarr3(self.path("a"), data, CHUNKS, skip={(1, 0, 1)}, fill=2.5)
        self.check("a", data)

    def test_dimension_names(self):
        data = pixels("uint8").transpose(1, 0, 2)
        write_zarr3(self.path("a"), data, CHUNKS, names=["y", "z", "x"])
        self.check("a", data.transpose(1, 0, 2))

    def test_shards(self):
        data = pixels("uint16")
        data[5:10, 8:16, :16] = 9
        chunk = (5, 8, 8)
        for n, (codecs, location, checked) in enumerate(itertools.product(self.CODECS.values(), ("start", "end"), (True, False))):
            with self.subTest(codecs=codecs, location=location, checked=checked):
                write_zarr3(self.path(f"a{n}"), data, chunk, codecs, shard=(2, 3, 2), index_location=location, checked=checked,
                            skip={(1, 1, 0), (1, 1, 1)}, fill=9)
                self.check(f"a{n}", data)
                self.assertEqual(self.report("info", f"a{n}")["image"]["chunk_size"], [8, 8, 5])

    def test_damaged_shards(self):
        data = pixels("uint16")
        codecs = self.CODECS["zstd-crc32c"]
        path = self.path("a")
        write_zarr3(path, data, (5, 8, 8), codecs, shard=(2, 3, 2))
        file = path / "c/0/0/0"
        good = file.read_bytes()
        for what, bad, message in (("chunk", good[:40] + bytes([good[40] ^ 1]) + good[41:], "the chunk is damaged: its crc32c"),
                                   ("index", good[:-30] + bytes([good[-30] ^ 1]) + good[-29:], "index is damaged: its crc32c"),
                                   ("cut", good[:-9], "index is damaged: its crc32c"), ("short", good[:50], "truncated"),
                                   ("empty", b"", "truncated")):
            with self.subTest(what):
                file.write_bytes(bad)
                error = self.run_covol("info", "a", code=3).stderr
                self.assertIn(message, error)
                self.assertIn("a/c/0/0/0", error)


class Pyramids(Case):
    def write2(self, name="a.zarr", axes_of=axes("zyx"), datasets=None, more=(), attributes=(), shape=SHAPE):
        group = zarr.open_group(str(self.path(name)), mode="w")
        datasets = datasets or [dataset("0", (2, 0.5, 0.5), (4, 10, -20)), dataset("1", (4, 1, 1))]
        for n, d in enumerate(datasets):
            step = 2 ** n
            size = shape[:-3] + tuple(-(-s // step) for s in shape[-3:])
            group.create_dataset(d["path"], data=pixels("u1", size, n), chunks=(1,) * (len(shape) - 3) + CHUNKS,
                                 dimension_separator="/")
        group.attrs["multiscales"] = [{"version": "0.4", "name": "m", "axes": axes_of, "datasets": datasets, **dict(more)}]
        for key, value in dict(attributes).items():
            group.attrs[key] = value
        return self.path(name)

    def test_levels(self):
        path = self.write2()
        info = self.report("info", path)["image"]
        self.assertEqual(info["format"], "OME-Zarr 0.4 (Zarr 2)")
        self.assertEqual((info["size"], info["spacing"], info["origin"], info["unit"]), ([34, 21, 13], [0.5, 0.5, 2], [-20, 10, 4], "um"))
        self.assertEqual(info["levels"], ["0: 34 x 21 x 13, spacing 0.5 x 0.5 x 2", "1: 17 x 11 x 7, spacing 1 x 1 x 4"])
        self.check(path, pixels("u1", seed=0))
        self.check(str(path) + "/0/", pixels("u1", seed=0))
        self.assertEqual(self.report("info", path / "0")["image"]["origin"], [-20, 10, 4])
        self.check(path / "1", pixels("u1", (7, 11, 17), 1))
        level = self.report("info", path / "1")["image"]
        self.assertEqual((level["spacing"], level["origin"]), ([1, 1, 4], [0, 0, 0]))
        self.assertIn("probably 0.25, 0.25, 1", level["fields"]["level_shift"])

    def test_level_shift(self):
        path = self.write2()
        errors = self.run_covol("info", path / "1", "--quiet").stderr
        self.assertIn("states no translation", errors)
        self.assertIn("--correct-level-shift corrects this", errors)
        self.assertEqual(errors.count("if its voxels are means"), 1)
        self.assertNotIn("warning", self.run_covol("info", path, "--quiet").stderr)
        done = self.run_covol("info", path / "1", "--correct-level-shift", "--quiet", "--json", "r.json")
        self.assertNotIn("warning", done.stderr)
        self.assertEqual(json.loads(self.path("r.json").read_text())["image"]["origin"], [0.25, 0.25, 1])
        path = self.write2("b.zarr", datasets=[dataset("0", (2, 0.5, 0.5)), dataset("1", (4, 1, 1), (1, 0.25, 0.25))])
        self.assertNotIn("warning", self.run_covol("info", path / "1", "--quiet").stderr)
        info = self.report("info", path / "1", "--correct-level-shift")["image"]
        self.assertEqual(info["origin"], [0.25, 0.25, 1])

    def test_transformations_of_the_whole_come_after(self):
        whole = [{"type": "scale", "scale": [10, 10, 10]}, {"type": "translation", "translation": [1, 2, 3]}]
        path = self.write2(more={"coordinateTransformations": whole})
        info = self.report("info", path)["image"]
        self.assertEqual((info["spacing"], info["origin"]), ([5, 5, 20], [-197, 102, 41]))

    def test_channels_and_units(self):
        names = ["membrane", "nuclei"]
        path = self.write2(axes_of=axes("tczyx", "nanometer"), datasets=[dataset("s0", (30, 1, 2, 0.5, 0.5))],
                           attributes={"omero": {"channels": [{"label": n} for n in names]}}, shape=(2, 2, *SHAPE))
        info = self.report("info", path)["image"]
        self.assertEqual((info["channels"], info["frames"], info["channel_names"], info["unit"]), (2, 2, names, "nm"))
        self.check(path, pixels("u1", (2, 2, *SHAPE), 0)[1, 0], "--channel", 0, "--frame", 1)
        mixed = axes("zyx")
        mixed[0]["unit"] = "nanometer"
        info = self.report("info", self.write2("b.zarr", mixed))["image"]
        self.assertEqual((info["unit"], [round(s, 9) for s in info["spacing"]]), ("um", [0.5, 0.5, 0.002]))

    def test_groups_of_several_images(self):
        path = self.write2("many.zarr/0")
        zarr.open_group(str(self.path("many.zarr")), mode="a").attrs["bioformats2raw.layout"] = 3
        self.assertEqual(self.report("info", "many.zarr")["image"]["size"], [34, 21, 13])
        shutil.copytree(path, self.path("many.zarr/1"))
        self.assertIn("many.zarr/0, many.zarr/1", self.run_covol("info", "many.zarr", code=3).stderr)

    def test_metadata_does_not_lead_out(self):
        for inside in ("../b.zarr/0", "/etc", "0/../../b.zarr", ""):
            path = self.write2()
            self.write2("b.zarr")
            meta = json.loads((path / ".zattrs").read_text())
            meta["multiscales"][0]["datasets"][0]["path"] = inside
            (path / ".zattrs").write_text(json.dumps(meta))
            self.assertIn("expected the path of an array below it", self.run_covol("info", path, code=3).stderr)

    def test_version_5(self):
        data = pixels("uint16", (2, *SHAPE))
        path = self.path("v5.zarr")
        write_zarr3(path / "0", data, (1, *CHUNKS), Version3.CODECS["zstd"], shard=(1, 2, 2, 2))
        write_zarr3(path / "1", data[:, ::2, ::2, ::2].copy(), (1, *CHUNKS))
        ome = {"version": "0.5", "omero": {"channels": [{"label": "a"}, {"label": "b"}]}, "multiscales": [
            {"axes": axes("czyx", "millimeter"), "datasets": [dataset("0", (1, 3, 2, 1)), dataset("1", (1, 6, 4, 2), (0, 1.5, 1, 0.5))]}]}
        (path / "zarr.json").write_text(json.dumps({"zarr_format": 3, "node_type": "group", "attributes": {"ome": ome}}))
        info = self.report("info", path)["image"]
        self.assertEqual((info["format"], info["spacing"], info["unit"]), ("OME-Zarr 0.5 (Zarr 3)", [1, 2, 3], "mm"))
        self.check(path, data[1], "--channel", 1)
        self.check(path / "1", data[0, ::2, ::2, ::2], "--channel", 0)
        self.assertEqual(self.report("info", path / "1")["image"]["origin"], [0.5, 1, 1.5])


class Lazy(Case):
    def test_a_ball_in_a_large_store(self):
        """1024^3 voxels, all missing except for a few chunks around a ball: segment reads only those around its marks."""
        n, size, centre, radius = 1024, 64, 500, 30
        array = zarr.open(str(self.path("large.zarr")), mode="w", shape=(n, n, n), chunks=(size,) * 3, dtype="u1", fill_value=0)
        low, high = centre - 40, centre + 40
        array[low:high, low:high, low:high] = ball(centre, radius, low, high)
        write_marks(self.path("marks.xyz"), centre, radius)
        report = self.report("segment", "large.zarr", "--spacing", "1,1,1", "--points", "marks.xyz", "-o", "ball.vdb")
        self.assertAlmostEqual(report["surface"]["volume"] / (4 / 3 * math.pi * radius ** 3), 1, delta=0.03)
        chunks = report["input"]["image"]["chunks"]
        self.assertEqual((chunks["size"], chunks["of"]), ([size] * 3, (n // size) ** 3))
        self.assertGreaterEqual(chunks["read"], 8)
        self.assertLess(chunks["read"], 100)
        self.assertLess(report["peak_rss_bytes"], 1 << 30)
        text = self.run_covol("info", "large.zarr", "--spacing", "1,1,1")
        self.assertIn("of 27 of 4096 chunks", text.stdout + text.stderr)
        text = self.run_covol("check", "large.zarr", "--spacing", "1,1,1")
        self.assertIn("27 of 4096 chunks were read", text.stdout + text.stderr)

        # A damaged chunk that the job needs is found when it is read.
        (self.path("large.zarr") / "7.7.7").write_bytes(b"\0" * 30)
        error = self.run_covol("segment", "large.zarr", "--spacing", "1,1,1", "--points", "marks.xyz", "-o", "b.vdb", code=3).stderr
        self.assertIn("large.zarr/7.7.7", error)


if __name__ == "__main__":
    unittest.main()
