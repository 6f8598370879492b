"""An OME-Zarr of 2048 x 2048 x 2048 voxels of 8 bits with a pyramid, of which only some chunks are created: the others are links
to them.

    /usr/bin/python3 tests/bench/marks/large_image.py FOLDER.zarr

A bright ball in noise; SIZE, CENTRE and RADIUS are in voxels.
"""
import itertools
import json
import os
import pathlib
import sys
import zlib

import numpy as np

SIZE, CHUNK, LEVELS, VARIANTS = 2048, 128, 5, 6
CENTRE, RADIUS = (1000, 1060, 980), 70
DARK, BRIGHT, NOISE = 60, 130, 8


def write_level(folder, level, rng):
    factor = 2 ** level
    count = SIZE // factor // CHUNK
    folder.mkdir()
    (folder / ".zarray").write_text(json.dumps({
        "zarr_format": 2, "shape": [SIZE // factor] * 3, "chunks": [CHUNK] * 3, "dtype": "|u1", "compressor": {"id": "zlib", "level": 1},
        "fill_value": 0, "order": "C", "filters": None, "dimension_separator": "."}))
    noise = NOISE / factor ** 1.5

    def pack(values):
        return zlib.compress(np.clip(values + rng.normal(0, noise, values.shape), 0, 255).round().astype(np.uint8).tobytes(), 1)

    # The background varies slowly, so that neighbouring slices differ. It is the same in every chunk, so that chunks
    # can be hard links to a few files.
    wave = 12 * np.sin(2 * np.pi * (np.arange(CHUNK) + 0.5) / CHUNK)
    background = DARK + (wave[:, None, None] + wave[None, :, None] + wave) / 3
    variants = []
    for n in range(VARIANTS):
        variants.append(folder / f"variant{n}")
        variants[-1].write_bytes(pack(background))
    for place in itertools.product(range(count), repeat=3):  # index of the chunk along x, y, z
        axes = [factor * (p * CHUNK + np.arange(CHUNK)) + (factor - 1) / 2 for p in place]
        nearest = [np.abs(a - c).min() if not a[0] <= c <= a[-1] else 0 for a, c in zip(axes, CENTRE)]
        name = folder / ".".join(str(p) for p in place[::-1])
        if np.hypot.reduce(nearest) > RADIUS + 2 * factor:
            os.link(variants[sum(p * q for p, q in zip(place, (1, 3, 5))) % VARIANTS], name)
            continue
        x, y, z = axes
        away = np.sqrt((z[:, None, None] - CENTRE[2]) ** 2 + (y[None, :, None] - CENTRE[1]) ** 2 + (x - CENTRE[0]) ** 2) - RADIUS
        name.write_bytes(pack(background + (BRIGHT - DARK) * np.clip(0.5 - away / factor, 0, 1)))
    for variant in variants:
        variant.unlink()


def make(folder):
    folder = pathlib.Path(folder)
    folder.mkdir()
    (folder / ".zgroup").write_text('{"zarr_format": 2}')
    scales = [{"path": str(n), "coordinateTransformations": [{"type": "scale", "scale": [0.5 * 2 ** n] * 3},
                                                             {"type": "translation", "translation": [0.25 * (2 ** n - 1)] * 3}]} for n in range(LEVELS)]
    axes = [{"name": a, "type": "space", "unit": "micrometer"} for a in "zyx"]
    (folder / ".zattrs").write_text(json.dumps({"multiscales": [{"version": "0.4", "axes": axes, "datasets": scales}]}))
    rng = np.random.default_rng(5)
    for n in range(LEVELS):
        write_level(folder / str(n), n, rng)


if __name__ == "__main__":
    make(sys.argv[1])
