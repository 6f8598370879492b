"""Blender imports all files of a job at the same position, with the same size, and smooth; skipped if Blender is not installed.

    COVOL=build/bin/covol python3 -m unittest tests/cli/blender_test.py
"""
import json
import os
import shutil
import subprocess
import sys
import tomllib
import unittest
from pathlib import Path

from interchange_test import CENTRE, COVOL, MISSING, Folder, ball, np, write_um_tiff

SCRIPT = "houdini_free_examples/13_blender.py"
BLENDER = shutil.which("blender")


@unittest.skipIf(MISSING, MISSING)
@unittest.skipUnless(BLENDER, "SKIPPED: Blender is not installed (apt-get install --no-install-recommends blender)")
class Blender(Folder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.run_covol(*cls.job, "-o", "both.vdb", "--density", "both.vdb", "--mesh", "m.ply")
        cls.run_covol("mesh", "both.vdb", "-o", "m.glb", "--quiet")

    def blender(self, *words, code=0):
        script = Path(__file__).resolve().parents[2] / SCRIPT
        done = subprocess.run([BLENDER, "-b", "--factory-startup", "--python", str(script), "--", ".", *words],
                              cwd=self.out, capture_output=True, text=True, timeout=300)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        return done

    def failed(self):
        report = json.loads((self.out / "blender.json").read_text())
        return [line["what"] for line in report["checks"] if not line["ok"]]

    def test_volume_and_meshes_agree_and_are_drawn(self):
        self.blender("both.vdb", "m.ply", "m.glb", "size=160x90")
        self.assertEqual(self.failed(), [])
        names = [line["what"] for line in json.loads((self.out / "blender.json").read_text())["checks"]]
        for grid in "both.vdb:surface", "both.vdb:density":
            self.assertTrue(any(name.startswith(grid) for name in names), names)
        data = (self.out / "blender.png").read_bytes()
        self.assertEqual(data[:8], b"\x89PNG\r\n\x1a\n")
        self.assertGreater(len(data), 160 * 90 / 8, "the picture is empty")

    def test_what_lies_elsewhere_is_found(self):
        self.run_covol("mesh", "both.vdb", "-o", "z.glb", "--up", "z", "--quiet")
        self.blender("both.vdb", "m.ply", "z.glb", "checks", code=1)
        self.assertIn("PLY and GLB: boxes differ", self.failed())
        self.run_covol("mesh", "both.vdb", "-o", "big.ply", "--unit-scale", "1.1", "--quiet")
        self.run_covol("mesh", "both.vdb", "-o", "big.glb", "--unit-scale", "1.1", "--quiet")
        self.blender("both.vdb", "big.ply", "big.glb", "checks", code=1)
        self.assertIn("both.vdb:surface: box off the mesh's", self.failed())
        self.blender("both.vdb", "m.ply", code=2)

    def test_every_compression_opens(self):
        for compression in "none", "zip", "blosc":
            with self.subTest(compression):
                self.run_covol("convert", "both.vdb", "packed.vdb", "--compression", compression, "--half", "--quiet")
                self.blender("packed.vdb", "m.ply", "m.glb", "checks")


@unittest.skipIf(MISSING, MISSING)
@unittest.skipUnless(BLENDER, "SKIPPED: Blender is not installed (apt-get install --no-install-recommends blender)")
class Addon(Folder):
    """Tests tools/blender, installed into a Blender without other add-ons."""

    def test_marks_become_objects(self):
        root = Path(__file__).resolve().parents[2]
        subprocess.run([sys.executable, root / "tools/plugins/pack.py", "blender", "--output", self.out], check=True, capture_output=True)
        [archive] = self.out.glob("covol_blender-*.zip")
        # A time-lapse in which the ball moves by one unit of length along x from each frame to the next.
        write_um_tiff(self.out / "movie.tif", np.stack([np.uint8(20 + 200 * ball(np.array(CENTRE) + (n, 0, 0))) for n in range(3)]))
        folder = self.out / "addon"
        folder.mkdir()
        environment = {**os.environ, "BLENDER_USER_SCRIPTS": str(self.out / "scripts"), "COVOL": str(Path(COVOL).resolve())}
        done = subprocess.run([BLENDER, "-b", "--factory-startup", "--python-exit-code", "1", "--python", root / "tests/cli/blender_addon.py",
                               "--", archive, self.private / "i.tif", self.private / "p.xyz", self.out / "movie.tif", folder],
                              capture_output=True, text=True, timeout=300, env=environment)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        checks = json.loads((folder / "addon.json").read_text())
        self.assertEqual([what for what, holds in checks.items() if not holds], [], done.stdout)
        self.assertGreater(len(checks), 30)

    def test_the_manifest_of_an_extension(self):
        """By the rules of Blender 4.2's manual; Debian's Blender does not support extensions."""
        root = Path(__file__).resolve().parents[2]
        manifest = tomllib.loads((root / "tools/blender/covol_blender/blender_manifest.toml").read_text())
        for name in ("schema_version", "id", "version", "name", "tagline", "maintainer", "type", "blender_version_min", "license"):
            self.assertTrue(manifest[name], name)
        self.assertLessEqual(len(manifest["tagline"]), 64)
        self.assertNotRegex(manifest["tagline"], r"[.!]$")
        self.assertLessEqual(set(manifest["permissions"]), {"files", "network", "clipboard", "camera", "microphone"})
        for text in manifest["permissions"].values():
            self.assertFalse(text.endswith("."))
        self.assertIn(manifest["version"], subprocess.run([COVOL, "--version"], capture_output=True, text=True).stdout)


if __name__ == "__main__":
    unittest.main()
