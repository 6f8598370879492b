"""A run of covol for Blender: the command line and its files. This module does not need Blender."""
import json
import os
import pathlib
import re
import shlex
import tempfile

import numpy as np

from . import _files, _process


FRAME = "_{frame:04}"  # pattern for the number of the frame in file names, for the program covol and for Python's format()


class Job:
    """A run in a folder. Its outputs have new names, because Blender caches volumes by file name.

    Attributes:
        vdb, ply, report: paths of the outputs; for a time-lapse, vdb and ply are patterns.
        is_lapse: whether all frames of the image are segmented.
    """

    def __init__(self, program, folder, name, image, places, voxel_size="", options="", is_lapse=False):
        """
        Args:
            image: path; if it is empty, the places are used alone, as a cloud.
            places: (n, 3), x, y, z, in the image's world; for a time-lapse, in its first frame.
            options: further options, in shell syntax.
            is_lapse: whether all frames of the image are segmented.

        Raises:
            Failed: invalid inputs, before the program is started.
        """
        if not len(places):
            raise _process.Failed(3, "no marks: choose an empty with children, or a mesh with vertices, on the border")
        try:
            more = shlex.split(options)
        except ValueError as error:
            raise _process.Failed(2, f"options: {options}: {error}") from None
        if is_lapse and not image:
            raise _process.Failed(3, "a time-lapse needs an image: choose one")
        found = _process.find_program(program)
        self.is_lapse = is_lapse
        self.folder = pathlib.Path(folder)
        self.folder.mkdir(parents=True, exist_ok=True)
        stem = re.sub(r"\W+", "_", name) or "covol"
        number = 1
        while any(self.folder.glob(f"{stem}_{number}[_.]*")):
            number += 1
        frame = FRAME if is_lapse else ""
        self.vdb, self.ply = (self.folder / f"{stem}_{number}{frame}.{end}" for end in ("vdb", "ply"))
        self.report = self.folder / f"{stem}_{number}.json"
        self._marks = tempfile.TemporaryDirectory(prefix="covol-blender-")
        marks = os.path.join(self._marks.name, "marks.csv")
        _files.write_positions(marks, places)
        outputs = ["-o", self.vdb, "--density", self.vdb, "--mesh", self.ply, "--json", self.report]
        size = [f"--voxel-size={voxel_size}"] if voxel_size.strip() else []
        frames = ["--frame=all"] if is_lapse else []
        job = ["segment", image, *frames, "--points", marks, "--points-space=world"] if image else ["reconstruct", marks]
        self.process = _process.Process(found, [*job, *size, *more, *outputs])

    def at(self, path, frame):
        """The file of a frame."""
        return pathlib.Path(str(path).replace(FRAME, FRAME.format(frame=frame)))

    def files(self):
        """All files that were written."""
        return sorted(self.folder.glob(self.report.stem + "[_.]*"))

    def result(self):
        """Waits for the end. Returns [(vertices, faces, report)] with one entry per frame, None for frames that failed. Raises Failed."""
        try:
            self.process.result()
        except _process.Failed:
            if not self.is_lapse or not self.report.exists():  # otherwise some frames succeeded
                raise
        finally:
            self._marks.cleanup()
        report = json.loads(self.report.read_text())
        return [self._read(n, found) if found.get("status", "ok") == "ok" else None
                for n, found in enumerate(report["frames"] if self.is_lapse else [report])]

    def _read(self, frame, report):
        columns, faces = _files.read_ply(self.at(self.ply, frame))
        return np.stack([columns[name] for name in "xyz"], 1), faces, report


def summary(found):
    """Summary of result() for a panel, in one line: the last frame, and the number of failed ones."""
    whole = [each for each in found if each is not None]
    surface = whole[-1][2]["surface"]
    state = f"closed, genus {surface['genus']}" if surface["closed"] else "not closed"
    frames = f"{len(whole)} of {len(found)} frames; the last: " if len(found) > 1 else ""
    return frames + f"volume {surface['volume']:.5g}, area {surface['area']:.5g}, {state}"
