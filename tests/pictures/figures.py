"""Pictures of covol's data for programs that Debian does not have, and of pages in a browser: HTML pages with planes of images,
surfaces drawn by VTK, and text, as headless Chromium shows them."""
import base64
import html
import io
import json
import re
import shutil
import subprocess
import sys
import tempfile
import time
from types import SimpleNamespace as Layer

import nibabel
import numpy as np
import tifffile
from PIL import Image

from work import ROOT

sys.path[:0] = [str(ROOT / "tests/cli"), str(ROOT / "tools/napari")]

BLUE, YELLOW, WHITE = (68, 119, 170), (255, 220, 60), (255, 255, 255)
COLORS = (BLUE, (238, 102, 119), (34, 136, 51), (204, 187, 68), (102, 204, 238), (170, 51, 119))
# The font is named because the default font, and with it the width of a picture, depends on the fonts that are
# installed.
STYLE = """body { margin: 0; padding: 10px; font: 13px/1.35 "DejaVu Sans", sans-serif; color: #222; background: #fff; width: max-content }
.row { display: flex; gap: 8px; align-items: flex-start } .column { display: flex; flex-direction: column; gap: 8px }
figure { margin: 0 } figcaption { padding: 2px 0 } img { display: block } pre { margin: 0; font: 12px/1.4 "DejaVu Sans Mono", monospace }
table { border-collapse: collapse } td, th { padding: 1px 8px 1px 0; text-align: left; font-weight: normal } th { color: #666 }
.cell { border-left: 3px solid #77a; background: #f5f5f8; padding: 6px 8px }"""


class Browser:
    """A headless Chromium."""

    def __enter__(self):
        from mark_page_case import start_chromium
        self.profile = tempfile.mkdtemp(prefix="covol-chromium-")
        self.driver = start_chromium(self.profile)
        return self.driver

    def __exit__(self, *_):
        self.driver.quit()
        shutil.rmtree(self.profile, ignore_errors=True)


def page(body):
    return f"<!DOCTYPE html><html><head><meta charset=utf-8><style>{STYLE}</style></head><body>{body}</body></html>"


def photograph(driver, path):
    """The page as displayed, with the width and height of its body."""
    width, height = driver.execute_script("const r = document.body.getBoundingClientRect(); return [Math.ceil(r.right), Math.ceil(r.bottom)]")
    shot = Image.open(io.BytesIO(driver.get_screenshot_as_png())).convert("RGB")
    if shot.width < width or shot.height < height:
        raise RuntimeError(f"{path}: a page of {width} x {height} does not fit into the window")
    shot.crop((0, 0, width, height)).save(path)


def compose(work, body, path):
    source = work.new_folder() / "page.html"
    source.write_text(page(body))
    with Browser() as driver:
        driver.get(source.as_uri())
        photograph(driver, path)


def shown(picture, caption=""):
    data = io.BytesIO()
    picture.save(data, "PNG")
    return f'<figure><img src="data:image/png;base64,{base64.b64encode(data.getvalue()).decode()}"><figcaption>{caption}</figcaption></figure>'


def plane(voxels, axis, index, spacing, scale=1.0, labels=None, color=BLUE, opacity=0.45, marks=(), mark_color=WHITE):
    """A plane of voxels (z, y, x) in true proportions, overlaid with labels; marks: (z, y, x) in voxels, of which those near the plane are drawn."""
    grey = np.take(voxels, index, axis).astype(float)
    low, high = np.percentile(voxels, (1, 99.7))
    pixels = np.repeat(np.clip((grey - low) / (high - low), 0, 1)[..., None] * 255, 3, axis=2)
    if labels is not None:
        inside = np.take(labels, index, axis) > 0
        edge = inside & ~(np.roll(inside, 1, 0) & np.roll(inside, -1, 0) & np.roll(inside, 1, 1) & np.roll(inside, -1, 1))
        pixels[inside] = (1 - opacity) * pixels[inside] + opacity * np.array(color)
        pixels[edge] = color
    rows, columns = [a for a in range(3) if a != axis]
    size = [round(scale * pixels.shape[n] * spacing[a]) for n, a in ((1, columns), (0, rows))]
    made = np.asarray(Image.fromarray(pixels.astype(np.uint8)).resize(size, Image.Resampling.BICUBIC)).copy()
    for mark in marks:
        if abs(mark[axis] - index) <= 0.5:
            y, x = (round(scale * (mark[a] + 0.5) * spacing[a]) for a in (rows, columns))
            made[max(0, y - 2):y + 3, max(0, x - 2):x + 3] = mark_color
    return Image.fromarray(made)


def scene(parts, size, points=(), point_color=WHITE, towards=(0.35, 1.0, -0.55), up=(0, 0, -1), zoom=1.5):
    """Draws surfaces, (vertices, faces, colour), and points by VTK, on white."""
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy
    import vtkmodules.vtkRenderingOpenGL2  # noqa: F401 - the import registers the OpenGL renderer
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
    from vtkmodules.vtkFiltersCore import vtkGlyph3D, vtkPolyDataNormals
    from vtkmodules.vtkFiltersSources import vtkSphereSource
    from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper, vtkRenderer, vtkRenderWindow, vtkWindowToImageFilter

    def polydata(places, triangles=None):
        made, kept = vtkPolyData(), vtkPoints()
        kept.SetData(numpy_to_vtk(np.ascontiguousarray(places, float), deep=True))
        made.SetPoints(kept)
        if triangles is not None:
            cells = vtkCellArray()
            cells.SetCells(len(triangles), numpy_to_vtkIdTypeArray(np.insert(np.asarray(triangles, np.int64), 0, 3, axis=1).ravel(), deep=True))
            made.SetPolys(cells)
        return made

    def add(source, paint):
        mapper, actor = vtkPolyDataMapper(), vtkActor()
        mapper.SetInputConnection(source.GetOutputPort())
        mapper.ScalarVisibilityOff()
        actor.SetMapper(mapper)
        actor.GetProperty().SetColor(*(c / 255 for c in paint))
        actor.GetProperty().SetAmbient(0.25)
        renderer.AddActor(actor)

    renderer = vtkRenderer()
    renderer.SetBackground(1, 1, 1)
    for vertices, faces, color in parts:
        normals = vtkPolyDataNormals()
        normals.SetInputData(polydata(vertices, faces))
        normals.SplittingOff()
        add(normals, color)
    if len(points):
        ball, glyphs = vtkSphereSource(), vtkGlyph3D()
        ball.SetRadius(0.01 * np.ptp(parts[0][0], axis=0).max())
        glyphs.SetInputData(polydata(points))
        glyphs.SetSourceConnection(ball.GetOutputPort())
        add(glyphs, point_color)
    camera = renderer.GetActiveCamera()
    camera.SetPosition(*(-np.array(towards)))
    camera.SetFocalPoint(0, 0, 0)
    camera.SetViewUp(*up)
    renderer.ResetCamera()
    camera.Zoom(zoom)
    window = vtkRenderWindow()
    window.SetOffScreenRendering(True)
    window.SetMultiSamples(8)
    window.SetSize(*size)
    window.AddRenderer(renderer)
    window.Render()
    grab = vtkWindowToImageFilter()
    grab.SetInput(window)
    grab.ReadFrontBufferOff()
    grab.Update()
    image = grab.GetOutput()
    width, height, _ = image.GetDimensions()
    return Image.fromarray(vtk_to_numpy(image.GetPointData().GetScalars()).reshape(height, width, -1)[::-1].copy())


def read_ply(path):
    """Reads a mesh by VTK's reader, which 3D Slicer and ParaView use."""
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOPLY import vtkPLYReader
    reader = vtkPLYReader()
    reader.SetFileName(str(path))
    reader.Update()
    mesh = reader.GetOutput()
    return vtk_to_numpy(mesh.GetPoints().GetData()), vtk_to_numpy(mesh.GetPolys().GetData()).reshape(-1, 4)[:, 1:]


def napari(work, path):
    """The layers that the plugin passes to napari: labels, surface, suggested points."""
    from covol_napari import layers
    volume = tifffile.imread(work.stack)
    spacing = work.spacing[::-1]
    image = Layer(data=volume, name="celegans_embryo", scale=spacing)
    made = layers.segment(image, Layer(data=work.marks[:, ::-1], scale=(1, 1, 1)), suggestions=3, voxel_size=3.0)
    (labels, about, _), ((vertices, faces), _, _), *points = made
    suggested = points[0][0] if points else np.zeros((0, 3))
    shown_slice = 12
    picture = plane(volume, 0, shown_slice, spacing, 1.35, labels, marks=work.marks[:, ::-1] / spacing)
    surface = scene([(vertices[:, ::-1], faces[:, ::-1], BLUE)], (440, 345), suggested[:, ::-1], YELLOW)
    rows = "".join(f"<tr><td>{kind.capitalize()}</td><td>{html.escape(meta['name'])}</td><td>{what}</td></tr>" for (_, meta, kind), what in zip(
        made, (f"{labels.dtype}, {labels.shape}", f"{len(vertices)} vertices, {len(faces)} triangles", f"{len(suggested)} places")))
    compose(work, f"<div class=row>{shown(picture, f'Image, Labels and Points, slice {shown_slice}')}{shown(surface, 'Surface, and suggested marks in yellow')}</div>"
                  f"<table><tr><th>layer</th><th>name</th><th>holds</th></tr>{rows}</table>", path)


def read_segmentation(path):
    """Voxels (z, y, x), and the fields of the first segment, of a .seg.nrrd."""
    import gzip
    head, data = path.read_bytes().split(b"\n\n", 1)
    fields = dict(line.split(":=", 1) for line in head.decode().splitlines() if ":=" in line)
    sizes = [int(n) for n in re.search(r"^sizes: (.*)$", head.decode(), re.M)[1].split()]
    return np.frombuffer(gzip.decompress(data), np.uint8).reshape(sizes[::-1]), fields


def three_planes(volume, labels, spacing, scale, marks=(), color=BLUE):
    """Axial, sagittal and coronal planes through the middle of the labels."""
    middle = [int(round(np.argwhere(labels > 0)[:, a].mean())) for a in range(3)]
    return [plane(volume, axis, middle[axis], spacing, scale, labels, color, marks=marks) for axis in (0, 2, 1)]


def slicer(work, path):
    """The segmentation and the model that the module passes to 3D Slicer, as read by its readers."""
    home = work.new_folder()
    work.covol("convert", work.stack, home / "volume.nrrd", "--quiet")
    work.covol("segment", home / "volume.nrrd", "--points", work.marks_file, "--voxel-size", 3, "-o", home / "cell.vdb", "--mask", home / "cell.seg.nrrd",
               "--mesh", home / "cell.ply", "--quiet")
    volume, (labels, fields) = tifffile.imread(work.stack), read_segmentation(home / "cell.seg.nrrd")
    color = tuple(round(255 * float(c)) for c in fields["Segment0_Color"].split())
    axial, sagittal, coronal = three_planes(volume, labels, work.spacing[::-1], 1.15, work.marks[:, ::-1] / work.spacing[::-1], color)
    model = scene([(*read_ply(home / "cell.ply"), color)], (442, 295), work.marks)
    bar = lambda name, paint: f'<span style="background:{paint};color:#fff;padding:0 8px">{name}</span>'
    compose(work, f"<div class=row><div class=column>{shown(axial, bar('R', '#c33') + ' axial')}{shown(coronal, bar('G', '#393') + ' coronal')}</div>"
                  f"<div class=column>{shown(model, bar('1', '#77a') + ' model cell.ply')}<div class=row>{shown(sagittal, bar('Y', '#b90') + ' sagittal')}"
                  f"<table><tr><th colspan=2>cell.seg.nrrd</th></tr><tr><td>Segment0_Name</td><td>{html.escape(fields['Segment0_Name'])}</td></tr>"
                  f"<tr><td>Segment0_LabelValue</td><td>{fields['Segment0_LabelValue']}</td></tr><tr><td>Segment0_Color</td><td>"
                  f"{fields['Segment0_Color']} <span style='background:rgb{color}'>&emsp;</span></td></tr></table></div></div></div>", path)


def itksnap(work, path):
    """Slices painted as in ITK-SNAP, and the resulting segmentation with its label descriptions."""
    home = work.new_folder()
    work.covol("convert", work.stack, home / "image.nii.gz", "--quiet")
    job = ["segment", home / "image.nii.gz", "--voxel-size", 3, "--quiet"]
    # The painted slices, which a person would draw, are every sixth slice of the mask of a surface through the marks.
    work.covol(*job, "--points", work.marks_file, "-o", home / "hand.vdb", "--mask", home / "hand.nii.gz")
    painted = nibabel.load(home / "hand.nii.gz")
    voxels = np.asarray(painted.dataobj).copy()
    voxels[:, :, [k for k in range(voxels.shape[2]) if k % 6 != 1]] = 0
    nibabel.save(nibabel.Nifti1Image(voxels, painted.affine, painted.header), home / "painted.nii.gz")
    work.covol(*job, "--painted", f"cell={home / 'painted.nii.gz'}", "-o", home / "cell.vdb", "--mask", home / "cell.nii.gz")
    labels = np.asarray(nibabel.load(home / "cell.nii.gz").dataobj).T
    volume = tifffile.imread(work.stack)
    number, red, green, blue = [int(n) for n in re.findall(r"^\s*([1-9]\d*)\s+(\d+)\s+(\d+)\s+(\d+)", (home / "cell_labels.txt").read_text(), re.M)[0]]
    before = three_planes(volume, voxels.T, work.spacing[::-1], 1.0, color=YELLOW)
    after = three_planes(volume, labels, work.spacing[::-1], 1.0, color=(red, green, blue))
    row = next(line for line in (home / "cell_labels.txt").read_text().splitlines() if re.match(rf"\s*{number}\s", line))
    compose(work, f"<div class=row><div class=column>{shown(before[2], 'painted.nii.gz, coronal: every sixth slice')}{shown(after[2], 'cell.nii.gz, coronal')}</div>"
                  f"<div class=column>{shown(after[0], 'cell.nii.gz, axial')}</div></div><pre>cell_labels.txt: {html.escape(row)}</pre>", path)


def cluster(work, path):
    """Bricks by Snakemake: its output, and the plan's bricks over the joined surface."""
    home = work.new_folder()
    work.covol("phantom", "torus", "--size", 128, "--count", 6000, "-o", home / "torus.nrrd", "--points", home / "torus.xyz", "--quiet")
    work.covol("brick", "plan", "segment", home / "torus.nrrd", "--points", home / "torus.xyz", "--model", "paper", "--brick-voxels", 60000,
               "-o", home / "plan", "--quiet")
    plan = json.loads((home / "plan/plan.json").read_text())
    done = subprocess.run(["snakemake", "-s", ROOT / "houdini_free_examples/bricks/Snakefile", "-j", "2", "--config", "plan=plan", "out=surface.vdb",
                           f"covol={work.program}", "threads=1", "join=--mesh surface.ply"], cwd=home, capture_output=True, text=True, timeout=600)
    if done.returncode:
        raise RuntimeError(done.stdout + done.stderr)
    vertices, faces = read_ply(home / "surface.ply")
    voxels = (vertices[faces].mean(axis=1) - plan["origin"]) / plan["voxel_size"]
    of = lambda brick: np.all((voxels >= np.array(brick["min"]) - 0.5) & (voxels < np.array(brick["max"]) + 0.5), axis=1)
    parts = [(vertices, faces[of(brick)], COLORS[n % len(COLORS)]) for n, brick in enumerate(plan["bricks"])]
    output = (done.stdout + done.stderr).splitlines()
    table = output[output.index("Job stats:"):]
    lines = table[:table.index("")] + [""] + [line for line in output if re.match(r"\d+ of \d+ steps", line)][-3:] + [""]
    lines += [line for line in output if re.match(r"covol: (neighbouring bricks|bricks|surface|points to surface|wrote)", line)]
    torus = shown(scene(parts, (320, 330), towards=(0.3, 0.8, -0.9), up=(0, 0, 1), zoom=1.25), "surface.ply, coloured here by bricks")
    compose(work, f"<div class=row>{torus}<pre>{html.escape(chr(10).join(lines))}</pre></div>", path)


def notebook(work, path):
    """Two output cells: the page of covol.mark(), and the table of a result."""
    import http.server
    import threading

    from live_client import Live, Page
    from selenium.webdriver.support.ui import WebDriverWait

    import covol
    class Quiet(http.server.SimpleHTTPRequestHandler):
        def log_message(self, *_):
            pass

    volume = tifffile.imread(work.stack)
    home = work.new_folder()
    server = http.server.ThreadingHTTPServer(("localhost", 0), lambda *words: Quiet(*words, directory=home))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    origin = f"http://localhost:{server.server_port}"
    study = covol.mark(volume, {"embryo": work.marks}, spacing=work.spacing, notebook=origin, program=work.program, height=520)
    try:
        # Voxels of 3 pixels, as in the other pictures. The page and study.result each solve the study, which would take
        # half a minute with voxels of 1 pixel.
        live = Live(Page(study.url))
        _, done = live.act(do="set_options", options={"voxel_size": 3})
        live.wait_for(1, "refined", done["seq"])
        live.close()
        result = study.result
        cells = [("study", study._repr_html_()), ('study.result["embryo"]', result["embryo"]._repr_html_())]
        (home / "index.html").write_text(page("<div class=column style='width:1000px'>" + "".join(
            f"<div class=cell><pre>{html.escape(code)}</pre></div><div>{out}</div>" for code, out in cells) + "</div>"))
        with Browser() as driver:
            driver.set_window_size(1060, 1100)
            driver.get(origin)
            wait = WebDriverWait(driver, 120)
            driver.switch_to.frame(wait.until(lambda _: driver.find_elements("tag name", "iframe"))[0])
            wait.until(lambda _: driver.execute_script(
                "const m = window.covolMark; return Boolean(m && m.state.get('link') === 'open' && m.study.structures.length "
                "&& m.study.structures[0].result && m.panels.every((p) => p.slice))"))
            time.sleep(3)  # seconds until the 3D view has been drawn
            driver.switch_to.default_content()
            photograph(driver, path)
    finally:
        study.close()
        server.shutdown()
