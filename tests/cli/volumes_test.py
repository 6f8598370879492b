"""Volumes for other programs: surface and density in one file, sequences, scenes of USD.

    COVOL=build/bin/covol python3 -m unittest tests/cli/volumes_test.py
"""
import re
import unittest

from interchange_test import CENTRE, MISSING, SPACING, Folder, ball, np, pyopenvdb, sphere, tifffile, write_um_tiff


def parse_usda(text):
    """{path: {name: value}} of the prims in a layer, "" for the layer's own metadata, by the grammar of the text form:
    nested braces, `type name = value`, time samples as {frame: value}."""
    tokens = re.findall(r'@@@.*?@@@|"[^"]*"|<[^>]*>|[\w:.+-]+|[{}()=,]', text.split("\n", 1)[1])
    prims, at = {"": {}}, 0

    def value():
        nonlocal at
        token = tokens[at]
        at += 1
        if token != "{":
            return token.strip('"') if token[0] != "@" else token[3:-3]
        entries = {}
        while tokens[at] != "}":
            frame = float(tokens[at].rstrip(":"))
            at += 1
            entries[frame] = value()
            if tokens[at] == ",":
                at += 1
        at += 1
        return entries

    def body(path, end):
        nonlocal at
        while tokens[at] != end:
            if tokens[at] == "def":
                kind, name = tokens[at + 1], tokens[at + 2].strip('"')
                prims[f"{path}/{name}"] = {"type": kind}
                assert tokens[at + 3] == "{", tokens[at:at + 5]
                at += 4
                body(f"{path}/{name}", "}")
            else:
                words = []
                while tokens[at] != "=":
                    words.append(tokens[at])
                    at += 1
                at += 1
                if words[-1] == "customLayerData":
                    at += 1
                    prims["data"] = {}
                    body("data", "}")
                else:
                    assert words[-1] not in prims[path], words
                    prims[path][words[-1]] = value()
        at += 1

    assert text.startswith("#usda 1.0\n")
    assert tokens[at] == "("
    at += 1
    body("", ")")
    while at < len(tokens):
        tokens.append("END")
        body("", "END")
    return prims


@unittest.skipIf(MISSING, MISSING)
class OneFile(Folder):
    def test_half_grids_are_grids(self):
        self.run_covol(*self.job, "-o", "h.vdb", "--half")
        self.assertNotIn("left out", self.run_covol("convert", "h.vdb", "c.vdb").stderr)
        self.run_covol("render", "h.vdb", "-o", "h.png", "--size", "300x200")

    def test_density_beside_the_surface(self):
        self.run_covol(*self.job, "-o", "both.vdb", "--density", "both.vdb")
        self.run_covol(*self.job, "-o", "alone.vdb", "--density", "fog.vdb")
        names = [g.name for g in pyopenvdb.readAllGridMetadata(str(self.out / "both.vdb"))]
        self.assertEqual(names, ["density", "surface"])
        for name, other in ("surface", "alone.vdb"), ("density", "fog.vdb"):
            together = pyopenvdb.read(str(self.out / "both.vdb"), name)
            self.assertEqual(together.activeVoxelCount(), pyopenvdb.read(str(self.out / other), name).activeVoxelCount())
        # compare chooses the level set of both.vdb, although its first grid is the density.
        report = self.report("compare", "both.vdb", "alone.vdb")
        self.assertEqual(report["compare"]["dice"], 1)
        self.run_covol("surface", "both.vdb:surface", "-o", "again.vdb", "--density", "again.vdb", "--quiet")
        self.assertEqual(len(pyopenvdb.readAllGridMetadata(str(self.out / "again.vdb"))), 2)

    def test_several_structures_have_a_density_each(self):
        centres = {name: np.add(CENTRE, (0, side, 0)) for name, side in (("a", -4.0), ("b", 4.0))}
        write_um_tiff(self.out / "two.tif", np.uint8(20 + 200 * np.maximum(*(ball(c, 3) for c in centres.values()))))
        for name, centre in centres.items():
            np.savetxt(self.out / f"{name}.xyz", sphere(300, centre, 3))
        self.run_covol("segment", "two.tif", "--points", "a=a.xyz", "b=b.xyz", "-o", "ab.vdb", "--density", "ab.vdb", "--usda",
                       "ab.usda", "--quiet")
        names = {g.name for g in pyopenvdb.readAllGridMetadata(str(self.out / "ab.vdb"))}
        self.assertEqual(names, {"density_a", "density_b", "a", "b"})
        prims = parse_usda((self.out / "ab.usda").read_text())
        self.assertEqual({p["fieldName"] for p in prims.values() if p.get("type") == "OpenVDBAsset"}, names)

    def test_scene_of_one_image(self):
        (self.out / "scenes").mkdir()
        self.run_covol(*self.job, "-o", "one.vdb", "--usda", "scenes/my scene.usda")
        prims = parse_usda((self.out / "scenes/my scene.usda").read_text())
        self.assertEqual(prims["/my_scene/surface"]["filePath"], "../one.vdb")
        self.assertTrue((self.out / "scenes" / prims["/my_scene/surface"]["filePath"]).resolve().is_file())
        self.assertNotIn("startTimeCode", prims[""])
        self.assertIn("--usda", self.run_covol(*self.job, "-o", "m.ply", "--usda", "x.usda", code=2).stderr)
        self.assertIn(".usda", self.run_covol(*self.job, "-o", "m.vdb", "--usda", "x.usd", code=3).stderr)


@unittest.skipIf(MISSING, MISSING)
class Sequences(Folder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.centres = [np.add(CENTRE, (0.4 * t, 0, 0)) for t in range(3)]
        movie = np.stack([np.uint8(20 + 200 * ball(c)) for c in cls.centres])
        tifffile.imwrite(cls.out / "movie.tif", movie, imagej=True, resolution=(1 / SPACING[0], 1 / SPACING[1]),
                         metadata={"axes": "TZYX", "spacing": SPACING[2], "unit": "um"})
        # The TIFF has no origin, so that positions begin at 0: the image's usual origin (10, -20, 5) is subtracted.
        np.savetxt(cls.out / "first.xyz", sphere(300, np.subtract(CENTRE, (10.0, -20.0, 5.0))))

    def test_names_and_scene(self):
        self.run_covol("segment", "movie.tif", "--frame", "all", "--points", "first.xyz", "-o", "cell_{frame:04d}.vdb",
                       "--density", "cell_{frame:04d}.vdb", "--mesh", "cell.ply", "--usda", "cell.usda", "--quiet")
        prims = parse_usda((self.out / "cell.usda").read_text())
        layer = prims[""]
        self.assertEqual((float(layer["metersPerUnit"]), layer["upAxis"], layer["defaultPrim"]), (1e-6, "Z", "cell"))
        self.assertEqual([float(layer[k]) for k in ("startTimeCode", "endTimeCode", "framesPerSecond")], [0, 2, 24])
        self.assertEqual(prims["/cell"], {"type": "Volume", "field:density": "</cell/density>",
                                          "field:surface": "</cell/surface>"})
        places = []
        for name, kind in ("surface", "levelSet"), ("density", "fogVolume"):
            prim = prims[f"/cell/{name}"]
            self.assertEqual((prim["type"], prim["fieldName"], prim["fieldClass"], prim["fieldDataType"]),
                             ("OpenVDBAsset", name, kind, "float"))
            self.assertEqual(prim["filePath.timeSamples"], {float(t): f"./cell_{t:04d}.vdb" for t in range(3)})
            for file in prim["filePath.timeSamples"].values():
                grid = pyopenvdb.read(str(self.out / file), name)
                low, high = grid.evalActiveVoxelBoundingBox()
                values = np.zeros(np.subtract(high, low) + 1, np.float32)
                grid.copyToArray(values, ijk=low)
                inside = np.argwhere(values < 0 if name == "surface" else values > 0.5) + low
                places.append(grid.transform.indexToWorld(tuple(inside.mean(axis=0)))[0])
        for of_kind in places[:3], places[3:]:
            np.testing.assert_allclose(np.diff(of_kind), 0.4, atol=0.05)
        self.assertTrue((self.out / "cell_t002.ply").is_file(), "a name without {frame} gets a suffix")


if __name__ == "__main__":
    unittest.main()
