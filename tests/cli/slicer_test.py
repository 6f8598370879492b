"""The module for 3D Slicer, run with mock objects for the functions that it uses, made from their documentation, because Debian
has no 3D Slicer. The mock objects write files with the program itself, and results are read here by other code.

    COVOL=build/bin/covol python3 -m unittest tests/cli/slicer_test.py
"""
import gzip
import importlib
import json
import re
import shutil
import subprocess
import sys
import tempfile
import time
import unittest
import zipfile
from pathlib import Path
from types import SimpleNamespace
from unittest import mock

from interchange_test import COVOL, MISSING, Folder, np, read_ply, sphere

ROOT = Path(__file__).resolve().parents[2]


class Segmentation:
    """vtkSegmentation: segments by ID, in order; here each with its voxels."""

    def __init__(self, segments):
        self.segments = dict(segments)

    def GetNumberOfSegments(self):
        return len(self.segments)

    def GetNthSegmentID(self, n):
        return list(self.segments)[n]

    def GetSegment(self, number):
        return self.segments.get(number)

    def RemoveSegment(self, number):
        del self.segments[number]

    def CopySegmentFromSegmentation(self, other, number, removeFromSource=False):
        assert number not in self.segments
        self.segments[number] = other.segments[number]


class Node:
    """vtkMRMLNode and the members of its derived classes."""

    def __init__(self, kind, name, **payload):
        self.kind, self.name, self.reference = kind, name, None
        self.__dict__.update(payload)

    def GetName(self):
        return self.name

    def SetName(self, name):
        self.name = name

    def IsA(self, kind):
        return self.kind == kind

    def GetNumberOfControlPoints(self):
        return len(self.places)

    def GetSegmentation(self):
        return self.segmentation

    def SetReferenceImageGeometryParameterFromVolumeNode(self, volume):
        self.reference = volume

    def GetPolyData(self):
        return self.polydata

    def SetAndObservePolyData(self, polydata):
        self.polydata = polydata


class Slicer:
    """The module `slicer`."""

    def __init__(self):
        self.nodes = []
        self.util = SimpleNamespace(exportNode=self.export, loadSegmentation=self.load_segmentation, loadModel=self.load_model,
                                    errorDisplay=mock.Mock())
        self.mrmlScene = SimpleNamespace(RemoveNode=self.nodes.remove, IsNodePresent=lambda node: node in self.nodes)

    def add(self, kind, name, **payload):
        self.nodes.append(Node(kind, name, **payload))
        return self.nodes[-1]

    def export(self, node, filename, properties={}, world=False):  # noqa: B006 - the signature of Slicer's exportNode()
        assert world and node in self.nodes  # world=True: otherwise transforms of the node would be ignored
        if hasattr(node, "file"):
            shutil.copy(node.file, filename)
        else:
            kind = {"vtkMRMLMarkupsClosedCurveNode": "ClosedCurve", "vtkMRMLMarkupsFiducialNode": "Fiducial"}[node.kind]
            Path(filename).write_text(json.dumps({"markups": [{"type": kind, "coordinateSystem": "LPS", "controlPoints": [
                {"id": str(n), "position": list(place)} for n, place in enumerate(node.places)]}]}))
        return True

    def load_segmentation(self, filename, properties={}):  # noqa: B006
        head, data = Path(filename).read_bytes().split(b"\n\n", 1)
        fields = dict(line.split(":=", 1) for line in head.decode().splitlines() if ":=" in line)
        sizes = [int(n) for n in re.search(r"^sizes: (.*)$", head.decode(), re.M)[1].split()]
        voxels = np.frombuffer(gzip.decompress(data), np.uint8).reshape(sizes[::-1])
        segments = {fields[f"Segment{n}_ID"]: voxels == int(fields[f"Segment{n}_LabelValue"]) for n in range(100) if f"Segment{n}_ID" in fields}
        return self.add("vtkMRMLSegmentationNode", Path(filename).stem, segmentation=Segmentation(segments))

    def load_model(self, filename, properties={}):  # noqa: B006
        return self.add("vtkMRMLModelNode", Path(filename).stem, polydata=read_ply(Path(filename))[1][:, :3])


@unittest.skipIf(MISSING, MISSING)
class Module(Folder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        subprocess.run([sys.executable, ROOT / "tools/plugins/pack.py", "slicer", "--output", cls.out], check=True, capture_output=True)
        [archive] = cls.out.glob("covol_slicer-*.zip")
        cls.module = cls.out / "slicer"
        zipfile.ZipFile(archive).extractall(cls.module)
        sys.path.insert(0, str(cls.module))
        cls.addClassCleanup(sys.path.remove, str(cls.module))
        cls.job = importlib.import_module("CovolLib.job")
        cls.process = importlib.import_module("CovolLib._process")
        cls.run_covol("convert", cls.private / "i.tif", "volume.nrrd", "--quiet")

    def setUp(self):
        self.slicer = Slicer()
        self.volume = self.slicer.add("vtkMRMLScalarVolumeNode", "ball", file=self.out / "volume.nrrd")
        self.points = self.slicer.add("vtkMRMLMarkupsFiducialNode", "F", places=sphere(60).tolist())

    def run_job(self, markups, *last, **more):
        made = self.job.Job(self.slicer, str(COVOL), self.volume, markups, **more)
        return made.finish(*last)

    def test_points_become_a_segmentation_and_a_model(self):
        segmentation, model, report = self.run_job([self.points])
        self.assertEqual((segmentation.GetName(), model.GetName(), segmentation.reference), ("ball covol", "ball covol surface", self.volume))
        [voxels] = segmentation.segmentation.segments.values()
        self.assertAlmostEqual(voxels.sum() * 0.125 / report["surface"]["volume"], 1, delta=0.03)
        distance = np.linalg.norm(model.GetPolyData() - sphere(60).mean(0), axis=1)
        self.assertLess(abs(distance - 3.5).mean(), 0.2)
        self.assertIn("closed, genus 0", self.job.summary(report)[0])
        self.assertIn("um^3", self.job.summary(report)[0])

    def test_the_next_result_goes_into_the_same_nodes(self):
        segmentation, model, _ = self.run_job([self.points])
        [number] = segmentation.segmentation.segments
        before, count = segmentation.segmentation.segments[number].sum(), len(self.slicer.nodes)
        segmentation.segmentation.segments["mine"] = "of a person"
        middle = sphere(60).mean(0)
        self.points.places = (middle + 0.7 * (sphere(60) - middle)).tolist()
        again = self.run_job([self.points], segmentation, model, options="--rho 0")
        self.assertEqual(again[:2], (segmentation, model))
        self.assertEqual(len(self.slicer.nodes), count)
        self.assertEqual(set(segmentation.segmentation.segments), {number, "mine"})
        self.assertAlmostEqual(segmentation.segmentation.segments[number].sum() / before, 0.343, delta=0.05)
        self.assertLess(np.ptp(model.GetPolyData(), axis=0).max(), 5.5)

    def test_curves_and_a_segmentation_to_correct(self):
        middle, turns = sphere(60).mean(0), np.linspace(0, 2 * np.pi, 24, endpoint=False)
        curves = []
        for z in np.arange(-3, 3.1, 1):
            part = np.sqrt(3.5**2 - z**2)
            ring = middle + np.stack([part * np.cos(turns), part * np.sin(turns), np.full(24, z)], 1)
            curves.append(self.slicer.add("vtkMRMLMarkupsClosedCurveNode", "CC", places=ring.tolist()))
        segmentation, _, report = self.run_job(curves)
        # The volume may differ by 8 %, because the curves do not reach the poles of the ball.
        self.assertAlmostEqual(report["surface"]["volume"] / (4 / 3 * np.pi * 3.5**3), 1, delta=0.08)
        self.run_covol("segment", self.private / "i.tif", "--points", self.private / "p.xyz", "-o", "g.vdb", "--mask", "guess.seg.nrrd", "--quiet")
        guess = self.slicer.add("vtkMRMLSegmentationNode", "guess", file=self.out / "guess.seg.nrrd")
        _, _, corrected = self.run_job([self.points], guess=guess)
        self.assertEqual(corrected["input"]["points"]["count"], 60)

    def test_what_is_wrong_is_reported(self):
        empty = self.slicer.add("vtkMRMLMarkupsFiducialNode", "F", places=[])
        far = self.slicer.add("vtkMRMLMarkupsFiducialNode", "F", places=[[1e4, 0, 0], [1e4, 1, 0], [1e4, 0, 1], [1e4, 1, 1]])
        before = set(Path(tempfile.gettempdir()).glob("covol-slicer-*"))
        for markups, more, expected_text in (([], {}, "no marks"), ([empty], {}, "no marks"), ([far], {}, "outside"),
                                    ([self.points], {"options": "--no-such-option"}, "--no-such-option"),
                                    ([self.points], {"options": "'"}, "further options")):
            with self.subTest(expected_text), self.assertRaisesRegex(self.process.Failed, expected_text):
                self.run_job(markups, **more)
        with self.assertRaisesRegex(self.process.Failed, "/nowhere/covol"):
            self.job.Job(self.slicer, "/nowhere/covol", self.volume, [self.points])
        self.assertEqual({node.kind for node in self.slicer.nodes} & {"vtkMRMLModelNode"}, set())
        self.assertEqual(set(Path(tempfile.gettempdir()).glob("covol-slicer-*")), before)

    def test_the_panel(self):
        """Its slots, with mock objects for Qt and CTK that accept everything."""
        self.slicer.app = mock.MagicMock()
        self.slicer.app.userSettings().value.return_value = str(COVOL)
        current = iter([self.volume, self.points, None, None])
        self.slicer.qMRMLNodeComboBox = lambda: mock.MagicMock(currentNode=mock.Mock(return_value=next(current)))
        base = SimpleNamespace(ScriptedLoadableModule=object, ScriptedLoadableModuleWidget=type("Base", (), {
            "setup": lambda self: setattr(self, "layout", mock.MagicMock())}))
        ctk = mock.MagicMock()
        ctk.ctkPathLineEdit.return_value.currentPath = str(COVOL)
        qt = mock.MagicMock()
        qt.QLineEdit.return_value.text = ""
        with mock.patch.dict(sys.modules, {"slicer": self.slicer, "slicer.ScriptedLoadableModule": base, "ctk": ctk, "qt": qt}):
            sys.modules.pop("Covol", None)
            widget = importlib.import_module("Covol").CovolWidget()
            widget.setup()
            for _ in range(2):
                widget.onStart()
                self.assertEqual(widget.start.text, "Cancel")
                for _ in range(600):
                    if widget.job is None:
                        break
                    time.sleep(0.1)
                    widget.onTick()
                self.assertIn("closed, genus 0", widget.message.text)
            self.assertEqual([node.kind for node in self.slicer.nodes].count("vtkMRMLModelNode"), 1)
            self.slicer.util.errorDisplay.assert_not_called()
            widget.onStart()
            widget.onStart()  # while a job runs, the button is Cancel
            while widget.job is not None:
                time.sleep(0.05)
                widget.onTick()
            self.assertEqual(widget.message.text, "cancelled")


if __name__ == "__main__":
    unittest.main()
