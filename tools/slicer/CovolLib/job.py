"""Runs covol on nodes of 3D Slicer: nodes are exported to files, the program runs, and its output files are loaded as nodes.

`slicer` is 3D Slicer's module, or an object with those of its functions that are used: util.exportNode(), util.loadSegmentation(),
util.loadModel(), mrmlScene. This module does not need 3D Slicer otherwise.
"""
import json
import os
import pathlib
import shlex
import tempfile

from . import _process

NAME = "covol"
CURVE, FIDUCIALS = "vtkMRMLMarkupsClosedCurveNode", "vtkMRMLMarkupsFiducialNode"


class Job:
    """One run. Create it, call `process.poll()` or `process.follow()`, then `finish()`."""

    def __init__(self, slicer, program, volume, markups, guess=None, options=""):
        """
        Args:
            volume: the volume node.
            markups: markup nodes: point lists are marks on the border, closed curves are outlines of the structure on slices.
            guess: a segmentation with one segment that is corrected by the marks, or None.
            options: further options, in shell syntax.

        Raises:
            Failed: invalid inputs, before the program is started.
        """
        try:
            more = shlex.split(options)
        except ValueError as error:
            raise _process.Failed(2, f"further options: {options}: {error}") from None
        if volume is None:
            raise _process.Failed(3, "expected a volume, got none")
        if not any(node.GetNumberOfControlPoints() for node in markups) and guess is None:
            raise _process.Failed(3, "no marks: place points on the border (Markups), or closed curves on slices")
        found = _process.find_program(program)
        self._slicer, self._volume = slicer, volume
        self._folder = tempfile.TemporaryDirectory(prefix="covol-slicer-")
        words = ["segment", self._export(volume, "volume.nrrd")]
        for n, node in enumerate(markups):
            if node.GetNumberOfControlPoints():
                flag = "--contours" if node.IsA(CURVE) else "--points"
                words += [flag, self._export(node, f"marks{n}.mrk.json")]
        if guess is not None:
            words += ["--guess", self._export(guess, "guess.seg.nrrd")]
        self._outputs = {"-o": "surface.vdb", "--mask": "result.seg.nrrd", "--mesh": "surface.ply", "--json": "report.json"}
        for flag, name in self._outputs.items():
            words += [flag, os.path.join(self._folder.name, name)]
        self.process = _process.Process(found, [*words, *more], self._folder.name)

    def _export(self, node, name):
        """Exports a node to a file in world coordinates, with its parent transforms applied."""
        path = os.path.join(self._folder.name, name)
        if self._slicer.util.exportNode(node, path, world=True) is False:
            raise _process.Failed(4, f"{node.GetName()}: 3D Slicer cannot write it")
        return path

    def finish(self, segmentation=None, model=None):
        """Waits for the end and stores the result in nodes: those of the last result, or new ones.

        Args:
            segmentation, model: nodes of the last result, or None.

        Returns:
            (segmentation, model, report). Raises Failed.
        """
        try:
            self.process.result()
            path = {name: os.path.join(self._folder.name, name) for name in self._outputs.values()}
            return (self._segmentation(path["result.seg.nrrd"], segmentation), self._model(path["surface.ply"], model),
                    json.loads(pathlib.Path(path["report.json"]).read_text(encoding="utf-8")))
        finally:
            self._folder.cleanup()

    def _segmentation(self, path, last):
        made = self._slicer.util.loadSegmentation(path)
        if last is None:
            made.SetName(f"{self._volume.GetName()} {NAME}")
            made.SetReferenceImageGeometryParameterFromVolumeNode(self._volume)
            return made
        # Only the segments of the last result are replaced; segments that the user has added to the same node stay.
        old, new = last.GetSegmentation(), made.GetSegmentation()
        for n in range(new.GetNumberOfSegments()):
            number = new.GetNthSegmentID(n)
            if old.GetSegment(number) is not None:
                old.RemoveSegment(number)
            old.CopySegmentFromSegmentation(new, number)
        self._slicer.mrmlScene.RemoveNode(made)
        return last

    def _model(self, path, last):
        made = self._slicer.util.loadModel(path)
        if last is None:
            made.SetName(f"{self._volume.GetName()} {NAME} surface")
            return made
        last.SetAndObservePolyData(made.GetPolyData())
        self._slicer.mrmlScene.RemoveNode(made)
        return last


def summary(report):
    """Summary of a result for a panel, as lines."""
    entry = (report.get("structures") or [report])[0]
    surface = entry["surface"]
    unit = report.get("input", {}).get("image", {}).get("unit") or "unit"
    state = f"closed, genus {surface['genus']}" if surface["closed"] else "not closed"
    return [f"volume {surface['volume']:.5g} {unit}^3, area {surface['area']:.5g} {unit}^2, {state}", *report.get("warnings", [])]
