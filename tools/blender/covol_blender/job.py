"""A run of covol for Blender: the command line and its files. Nothing here needs Blender."""
import json
import os
import pathlib
import re
import shlex
import tempfile

from . import _files, _process


class Job:
    """A run in a folder, whose outputs have names that no earlier run there has: Blender keeps volumes by their file's name.

    Attributes:
        vdb, ply, report: paths of the outputs.
    """

    def __init__(self, program, folder, name, image, places, voxel_size="", options=""):
        """
        Args:
            image: path, or empty: the places alone, as a cloud.
            places: (n, 3), x, y, z, in the image's world.
            options: further options, as a shell would have them.

        Raises:
            Failed: what cannot be run is said before anything is started.
        """
        if not len(places):
            raise _process.Failed(3, "no marks: choose an empty with children, or a mesh with vertices, on the border")
        try:
            more = shlex.split(options)
        except ValueError as error:
            raise _process.Failed(2, f"further options: {options}: {error}") from None
        found = _process.find_program(program)
        self.folder = pathlib.Path(folder)
        self.folder.mkdir(parents=True, exist_ok=True)
        stem = re.sub(r"\W+", "_", name) or "covol"
        number = 1
        while (self.folder / f"{stem}_{number}.vdb").exists():
            number += 1
        self.vdb, self.ply, self.report = (self.folder / f"{stem}_{number}.{end}" for end in ("vdb", "ply", "json"))
        self._marks = tempfile.TemporaryDirectory(prefix="covol-blender-")
        marks = os.path.join(self._marks.name, "marks.csv")
        _files.write_positions(marks, places)
        outputs = ["-o", self.vdb, "--density", self.vdb, "--mesh", self.ply, "--json", self.report]
        size = [f"--voxel-size={voxel_size}"] if voxel_size.strip() else []
        job = ["segment", image, "--points", marks, "--points-space=world"] if image else ["reconstruct", marks]
        self.process = _process.Process(found, [*job, *size, *more, *outputs])

    def result(self):
        """Waits for the end: (vertices, faces, report). Raises Failed."""
        try:
            self.process.result()
        finally:
            self._marks.cleanup()
        columns, faces = _files.read_ply(self.ply)
        return [columns[name] for name in "xyz"], faces, json.loads(self.report.read_text())


def summary(report):
    """What a panel says of a result, in one line."""
    surface = report["surface"]
    state = f"closed, genus {surface['genus']}" if surface["closed"] else "not closed"
    return f"volume {surface['volume']:.5g}, area {surface['area']:.5g}, {state}"
