"""`covol mark` on an image in chunks with a pyramid: the level from which slices are taken, and surfaces if only some chunks
exist.

    COVOL=build/bin/covol python3 -m unittest tests/cli/mark_large_test.py
"""
import json
import pathlib
import subprocess
import unittest
import zlib

import numpy as np

from covol_case import COVOL, Case, sphere_points
from live_client import Live, Page

SIZE, CHUNK, LEVELS, SPACING = (256, 1024, 1024), 64, 3, 0.5  # size z, y, x; large enough to be read chunk by chunk
MIDDLE, RADIUS = np.array([96, 160, 224]), 20                 # x, y, z of a bright ball within one chunk; voxels


def write_pyramid(folder):
    """Voxels are 10 where there is no chunk; in the ball, level n is brighter than level 0 by 40 n, so that the displayed level can be recognised."""
    folder.mkdir()
    (folder / ".zgroup").write_text('{"zarr_format": 2}')
    scales = [{"path": str(n), "coordinateTransformations": [{"type": "scale", "scale": [SPACING * 2 ** n] * 3}]} for n in range(LEVELS)]
    axes = [{"name": a, "type": "space", "unit": "micrometer"} for a in "zyx"]
    (folder / ".zattrs").write_text(json.dumps({"multiscales": [{"version": "0.4", "axes": axes, "datasets": scales}]}))
    for n in range(LEVELS):
        level, factor = folder / str(n), 2 ** n
        level.mkdir()
        (level / ".zarray").write_text(json.dumps({
            "zarr_format": 2, "shape": [s // factor for s in SIZE], "chunks": [CHUNK] * 3, "dtype": "|u1", "compressor": {"id": "zlib", "level": 1},
            "fill_value": 10, "order": "C", "filters": None, "dimension_separator": "."}))
        place = MIDDLE // (CHUNK * factor)
        x, y, z = (factor * (place[a] * CHUNK + np.arange(CHUNK)) + (factor - 1) / 2 for a in range(3))
        far = np.sqrt((z[:, None, None] - MIDDLE[2]) ** 2 + (y[None, :, None] - MIDDLE[1]) ** 2 + (x - MIDDLE[0]) ** 2) - RADIUS
        values = 10 + (100 + 40 * n) * np.clip(0.5 - far, 0, 1)
        (level / ".".join(str(p) for p in place[::-1])).write_bytes(zlib.compress(values.astype(np.uint8).tobytes()))


class Large(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.store = pathlib.Path(cls.inputs) / "large.zarr"
        write_pyramid(cls.store)

    def start(self, image):
        program = subprocess.Popen([COVOL, "mark", image, self.out / "study", "--no-browser"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        self.addCleanup(program.stdout.close)
        self.addCleanup(program.wait)
        self.addCleanup(program.kill)
        return Page(program.stdout.readline().split()[1])

    def slice(self, page, facts, **query):
        status, headers, body = page.get("/slice?" + "&".join(f"{name}={value}" for name, value in query.items()))
        self.assertEqual(status, 200, body)
        values = np.frombuffer(body, "<u2").reshape(int(headers["X-Height"]), int(headers["X-Width"]))
        return facts["low"] + values / 65535 * (facts["high"] - facts["low"]), int(headers["X-Factor"])

    def test_a_slice_comes_from_the_level_that_suffices(self):
        page = self.start(self.store)
        facts = page.json("/image")
        self.assertEqual(facts["levels"], [[1, 1, 1], [2, 2, 2], [4, 4, 4]])
        self.assertTrue(facts["in_chunks"])
        self.assertEqual((facts["low"], facts["high"]), (0, 255))
        for step, factor, bright in ((1, 1, 110), (2, 2, 150), (3, 1, 110), (4, 4, 190), (8, 4, 190)):
            for axis in range(3):
                right, down = [a for a in range(3) if a != axis]
                values, from_factor = self.slice(page, facts, axis=axis, at=MIDDLE[axis], step=step)
                sizes = [-(-SIZE[2 - a] // step) for a in (down, right)]
                self.assertEqual(values.shape, tuple(sizes))
                self.assertEqual(from_factor, factor)
                self.assertAlmostEqual(values[MIDDLE[down] // step, MIDDLE[right] // step], bright, delta=0.01)
                self.assertAlmostEqual(values[0, 0], 10, delta=0.01)

    def test_a_part_of_a_slice_is_that_part(self):
        page = self.start(self.store)
        facts = page.json("/image")
        whole, _ = self.slice(page, facts, axis=2, at=MIDDLE[2], step=1)
        part, _ = self.slice(page, facts, axis=2, at=MIDDLE[2], step=1, x=70, y=130, width=55, height=5000)
        np.testing.assert_array_equal(part, whole[130:, 70:125])
        for wrong in ("x=1024&y=0&width=1&height=1", "x=0&y=0&width=0&height=1", "x=0&y=0&width=1"):
            self.assertEqual(page.get(f"/slice?axis=2&at=0&step=1&{wrong}")[0], 400)

    def test_a_level_by_itself_has_those_that_are_coarser(self):
        page = self.start(self.store / "0")
        self.assertEqual(len(page.json("/image")["levels"]), LEVELS)

    def test_marks_give_the_surface_that_the_program_gives(self):
        page = self.start(self.store)
        live = Live(page)
        self.addCleanup(live.close)
        one = live.add_structure("ball")
        unit = np.array(sphere_points(40))
        unit = (unit - unit.mean(0)) / np.linalg.norm(unit - unit.mean(0), axis=1)[:, None]
        for place in (MIDDLE + RADIUS * unit) * SPACING:
            live.add_mark(one, place.tolist())
        refined = live.wait_for(one, "refined", 41)
        self.assertAlmostEqual(refined["volume"] / (4 / 3 * np.pi * (RADIUS * SPACING) ** 3), 1, delta=0.05)
        self.run_covol("segment", "--study", self.out / "study", "-o", self.out / "ball.vdb", "--mesh", self.out / "ball.ply", "--json", self.out / "ball.json")
        report = json.loads((self.out / "ball.json").read_text())
        self.assertEqual(report["structures"][0]["surface"]["volume"], refined["volume"])
        self.assertLess(report["input"]["image"]["chunks"]["read"], 60)  # of 1024 chunks (4 x 16 x 16)


if __name__ == "__main__":
    unittest.main()
