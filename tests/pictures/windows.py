"""Pictures of the windows of programs that Debian has, with covol's plugins in them. They need a screen, which may be virtual."""
import os
import shutil
import subprocess
import sys

import numpy as np
from PIL import Image

from work import ROOT, crop

sys.path.append(str(ROOT / "tests/cli"))
from imagej_test import JAR, MACRO, roi_of_points  # noqa: E402

SHOWN_SLICE = 13  # the slice that is shown in ImageJ, counted from 1
IMAGEJ = """
open("%(stack)s");
open("%(marks)s");
said = runMacro("%(macro)s", "program=%(program)s\\nvoxel size=3\\noptions=--quiet");
if (said != "") File.saveString(said, "%(out)s/said.txt");
selectImage("%(title)s");
setSlice(%(slice)d);
setLocation(0, 80, 640, 470);
selectImage("Mask of %(title)s");
setSlice(%(slice)d);
setLocation(646, 0, 354, 284);
Table.setLocationAndSize(646, 290, 354, 260, "covol: %(title)s");
wait(3000);
run("Capture Screen");
saveAs("PNG", "%(out)s/screen.png");
exec("sh", "-c", "kill $PPID");
"""


def fiji(work, path):
    """ImageJ after Plugins > Covol: the stack with marks and outline, the mask, the table."""
    home = work.new_folder()
    (home / ".imagej").mkdir()
    (home / ".imagej/IJ_Prefs.txt").write_text("ij.x=0\nij.y=0\n")
    rows = [(x, y, round(z / work.spacing[2]) + 1) for x, y, z in work.marks]
    (home / "marks.roi").write_bytes(roi_of_points(rows))
    (home / "shown.ijm").write_text(IMAGEJ % {"stack": work.stack, "marks": home / "marks.roi", "macro": MACRO, "program": work.program,
                                              "out": home, "title": work.stack.name, "slice": SHOWN_SLICE})
    done = subprocess.run(["java", "-Xmx1g", f"-Duser.home={home}", "-cp", JAR, "ij.ImageJ", "-macro", home / "shown.ijm"],
                          capture_output=True, text=True, timeout=300)
    if not (home / "screen.png").exists() or (home / "said.txt").exists():
        raise RuntimeError(f"ImageJ made no picture: {done.stdout}{done.stderr}")
    crop(Image.open(home / "screen.png")).save(path)


def blender(work, path):
    """Blender after Find the surface: the panel, the mesh, the objects."""
    home = work.new_folder()
    subprocess.run([sys.executable, ROOT / "tools/plugins/pack.py", "blender", "--output", home], check=True, capture_output=True)
    [archive] = home.glob("covol_blender-*.zip")
    np.savetxt(home / "marks.xyz", work.marks)
    stack = shutil.copy(work.stack, home)  # a copy in `home`, because the window shows the file's path
    environment = {**os.environ, "BLENDER_USER_SCRIPTS": str(home / "scripts"), "COVOL": str(work.program)}
    done = subprocess.run(["blender", "--factory-startup", "--enable-event-simulate", "--python-exit-code", "1", "-p", "0", "0", "1100", "700",
                           "--python", ROOT / "tests/pictures/blender_window.py", "--", archive, stack, home / "marks.xyz", home],
                          capture_output=True, text=True, timeout=300, env=environment)
    if not (home / "screen.png").exists():
        raise RuntimeError(f"Blender made no picture: {done.stdout}{done.stderr}")
    Image.open(home / "screen.png").convert("RGB").save(path)
