"""The module Covol of 3D Slicer: computes the surface through markups on a volume, as a segmentation and a model.

To install it, add the folder of this file to Edit > Application Settings > Modules > Additional module paths. Needs the program covol
and Linux. The functions are in CovolLib/job.py; this file contains only the panel.
"""
import ctk
import qt
import slicer
from slicer.ScriptedLoadableModule import ScriptedLoadableModule, ScriptedLoadableModuleWidget

from CovolLib import _process, job

TICK = 100  # milliseconds between two checks whether the running program has sent events


class Covol(ScriptedLoadableModule):
    def __init__(self, parent):
        ScriptedLoadableModule.__init__(self, parent)
        parent.title = "Covol"
        parent.categories = ["Segmentation"]
        parent.dependencies = []
        parent.contributors = ["the authors of covol"]
        parent.helpText = "Finds the surface of a structure through a few points on its border, or closed curves on slices."
        parent.acknowledgementText = "Method: doi:10.3934/dcdss.2020351"


class CovolWidget(ScriptedLoadableModuleWidget):
    def setup(self):
        ScriptedLoadableModuleWidget.setup(self)
        self.job = self.segmentation = self.model = None
        box = ctk.ctkCollapsibleButton()
        box.text = "Segment with marks"
        self.layout.addWidget(box)
        form = qt.QFormLayout(box)
        self.volume = self._selector(form, "Volume", ["vtkMRMLScalarVolumeNode"])
        self.points = self._selector(form, "Points on the border", [job.FIDUCIALS], none=True)
        self.curves = self._selector(form, "Closed curves", [job.CURVE], none=True)
        self.guess = self._selector(form, "Segmentation to correct", ["vtkMRMLSegmentationNode"], none=True)
        self.options = qt.QLineEdit()
        self.options.placeholderText = "--voxel-size 2vx"
        form.addRow("Further options", self.options)
        self.program = ctk.ctkPathLineEdit()
        self.program.currentPath = slicer.app.userSettings().value("Covol/program", "")
        form.addRow("Program covol", self.program)
        self.start = qt.QPushButton("Find the surface")
        self.start.connect("clicked(bool)", self.onStart)
        form.addRow(self.start)
        self.message = qt.QLabel()
        self.message.wordWrap = True
        form.addRow(self.message)
        self.layout.addStretch(1)
        self.timer = qt.QTimer()
        self.timer.setInterval(TICK)
        self.timer.connect("timeout()", self.onTick)

    @staticmethod
    def _selector(form, label, kinds, none=False):
        selector = slicer.qMRMLNodeComboBox()
        selector.nodeTypes = kinds
        selector.addEnabled = selector.removeEnabled = False
        selector.noneEnabled = none
        selector.setMRMLScene(slicer.mrmlScene)
        form.addRow(label, selector)
        return selector

    def onStart(self, _=False):
        if self.job is not None:
            return self.job.process.cancel()
        slicer.app.userSettings().setValue("Covol/program", self.program.currentPath)
        markups = [node for node in (self.points.currentNode(), self.curves.currentNode()) if node is not None]
        try:
            self.job = job.Job(slicer, self.program.currentPath, self.volume.currentNode(), markups, self.guess.currentNode(), self.options.text)
        except _process.Failed as error:
            return slicer.util.errorDisplay(str(error))
        self.start.text = "Cancel"
        self.timer.start()

    def onTick(self):
        events = self.job.process.poll()
        for kind, value in events or []:
            self.message.text = f"{value[0]} {100 * value[1]:.0f} %" if kind == "stage" else value
        if events is not None:
            return
        self.timer.stop()
        self.start.text = "Find the surface"
        done, self.job = self.job, None
        # The user may have removed the nodes of the last result.
        last = [node if node is not None and slicer.mrmlScene.IsNodePresent(node) else None for node in (self.segmentation, self.model)]
        try:
            self.segmentation, self.model, report = done.finish(*last)
            self.message.text = "\n".join(job.summary(report))
        except _process.Interrupted:
            self.message.text = "cancelled"
        except _process.Failed as error:
            self.message.text = str(error)
            slicer.util.errorDisplay(str(error))

    def cleanup(self):
        self.timer.stop()
        if self.job is not None:
            self.job.process.cancel()
