"""Recipes that covol's tests do not run: the files that they name exist, and version numbers agree.

    COVOL=build/bin/covol python3 -m unittest tests/cli/recipes_test.py
"""
import ast
import re
import subprocess
import tomllib
import unittest
from pathlib import Path

import yaml

from covol_case import COVOL

ROOT = Path(__file__).resolve().parents[2]


class Recipes(unittest.TestCase):
    def setUp(self):
        self.version = subprocess.run([COVOL, "--version"], capture_output=True, text=True, check=True).stdout.split()[1]

    def expect_commands(self, text):
        """Scripts, presets and targets that a text calls exist, and covol's own command lines have no unknown option."""
        for path in re.findall(r"(?<![\w/])(?:tests|tools)/[\w./-]+\.(?:sh|py)", text):
            self.assertTrue((ROOT / path).exists(), path)
        presets = (ROOT / "CMakePresets.json").read_text()
        for preset in re.findall(r"--preset (\w+)", text):
            self.assertIn(f'"name": "{preset}"', presets)
        for option in re.findall(r"-D(COVOL_\w+)", text):
            declared = "".join(path.read_text() for path in [ROOT / "CMakeLists.txt", ROOT / "lib/CMakeLists.txt"])
            self.assertIn(option, declared)

    def test_containerfile(self):
        text = (ROOT / "tools/packaging/Containerfile").read_text()
        steps = [line.split(maxsplit=1) for line in re.sub(r"^#.*\n", "", text, flags=re.M).splitlines() if line.strip()]
        self.assertLessEqual({step[0] for step in steps}, {"FROM", "COPY", "WORKDIR", "RUN", "USER", "ENTRYPOINT", "CMD"})
        self.assertEqual([step[1] for step in steps if step[0] == "ENTRYPOINT"], ['["covol"]'])
        last = [n for n, step in enumerate(steps) if step[0] == "FROM"][-1]
        self.assertIn("USER", [step[0] for step in steps[last:]])  # the image that is shipped does not run as root
        self.expect_commands(text)

    def test_conda(self):
        recipe = yaml.safe_load((ROOT / "tools/packaging/conda/recipe.yaml").read_text().replace("${{", "<").replace("}}", ">"))
        self.assertEqual(recipe["context"]["version"], self.version)
        self.assertLessEqual(set(recipe), {"context", "package", "source", "build", "requirements", "tests", "about"})
        for name in recipe["about"]["license_file"]:
            self.assertTrue((ROOT / name).exists(), name)
        self.expect_commands(" ".join(recipe["build"]["script"]))

    def test_workflow(self):
        text = (ROOT / ".github/workflows/build.yml").read_text()
        jobs = yaml.safe_load(text)["jobs"]
        for job in jobs.values():
            for needed in job.get("needs", []):
                self.assertIn(needed, jobs)
            for step in job["steps"]:
                self.assertEqual(len({"run", "uses"} & set(step)), 1, step)
        self.expect_commands(text)

    def test_versions_are_one(self):
        manifest = tomllib.loads((ROOT / "tools/blender/covol_blender/blender_manifest.toml").read_text())
        napari = tomllib.loads((ROOT / "tools/napari/pyproject.toml").read_text())["project"]
        self.assertEqual((manifest["version"], napari["version"]), (self.version, self.version))
        addon = ast.parse((ROOT / "tools/blender/covol_blender/__init__.py").read_text())
        [info] = [ast.literal_eval(node.value) for node in addon.body if isinstance(node, ast.Assign) and node.targets[0].id == "bl_info"]
        self.assertEqual(".".join(map(str, info["version"])), self.version)
        newest = re.search(r"^## (\S+)", (ROOT / "CHANGELOG.md").read_text(), re.M)[1].rstrip(",")
        self.assertEqual(newest, self.version)
        for name in re.findall(r"covol[-_](\d+\.\d+\.\d+)", (ROOT / "docs/install.md").read_text()):
            self.assertEqual(name, self.version)


if __name__ == "__main__":
    unittest.main()
