"""Results of the module: their accuracy, and agreement with the program's results for the same files."""
import json
import os
import pathlib
import re
import subprocess
import sys

import numpy as np
import pytest

import covol
from conftest import dice

HERE = pathlib.Path(__file__).resolve().parent
DATA = HERE.parents[1] / "houdini_free_examples/data"


def run(program, *words):
    return subprocess.run([program, *map(str, words), "--quiet"], capture_output=True, text=True, check=True)


def described(program):
    return json.loads(subprocess.run([program, "--describe-options"], capture_output=True, text=True, check=True).stdout)


def test_accuracy(sphere, solved):
    _, _, labels = sphere
    assert dice(solved.mask, labels) > 0.99
    assert solved.report["surface"]["volume"] == pytest.approx(4 / 3 * np.pi * 0.8**3, rel=0.02)
    radius = np.linalg.norm(solved.mesh.vertices, axis=1)
    assert abs(radius - 0.8).max() < 0.3 * solved.surface.voxel_size


@pytest.mark.parametrize("kind, count, options", [
    ("two-spheres", 120, {}), ("torus", 900, {"model": "paper", "max_steps": 20, "delta": "0.5vx"}),
    ("torus", 900, {"model": "paper", "max_steps": 2})])
def test_the_program_gives_the_same(tmp_path, program, kind, count, options):
    flags = [word for name, value in options.items() for word in ("--" + name.replace("_", "-"), str(value))]
    image, points, mask, report = (tmp_path / name for name in ("i.nrrd", "p.ply", "m.nrrd", "r.json"))
    run(program, "phantom", kind, "--size", 48, "--count", count, "-o", image, "--points", points)
    run(program, "segment", image, "--points", points, "-o", tmp_path / "s.vdb", "--mask", mask, "--mesh", tmp_path / "s.ply",
        "--json", report, *flags)
    result = covol.segment(image, points, **options)
    assert np.array_equal(result.mask, covol.read_image(mask).array)
    mesh = covol.read_mesh(tmp_path / "s.ply")
    assert np.array_equal(mesh.faces, result.mesh.faces) and np.array_equal(mesh.vertices, result.mesh.vertices)
    theirs = json.loads(report.read_text())
    for part in ("resolved", "grid", "surface", "fit"):
        assert result.report[part] == theirs[part]
    # In Python, messages name keywords, `max_steps`, and in the program options, --max-steps.
    named = [re.sub(r"`(\w+)`", lambda found: "--" + found[1].replace("_", "-"), line) for line in result.warnings]
    assert named == theirs.get("warnings", [])
    assert any("not steady" in line for line in result.warnings) == (options.get("max_steps") == 2)
    # Arrays in memory give the same mask as files.
    read, marks = covol.read_image(image), covol.read_points(points)
    again = covol.segment(np.array(read.array), marks.array, spacing=read.spacing, origin=read.origin, **options)
    assert np.array_equal(again.mask, result.mask)


def test_a_real_stack(tmp_path, program):
    """The quickstart's embryo: marks in a table, a TIFF, voxels of 3 pixels."""
    stack, marks, check = DATA / "celegans_embryo.tif", DATA / "celegans_marks.csv", DATA / "celegans_check.csv"
    run(program, "segment", stack, "--points", marks, "--voxel-size", 3, "-o", tmp_path / "e.vdb", "--mask", tmp_path / "e.nrrd",
        "--suggest", 2, "--json", tmp_path / "e.json")
    result = covol.segment(stack, marks, voxel_size=3)
    assert np.array_equal(result.mask, covol.read_image(tmp_path / "e.nrrd").array)
    held_out = covol.read_points(check).to_world(result.image)
    assert covol.distances(held_out, result)["mean"] < 1.0  # in voxels; docs/commands/segment.md states 0.74
    found = result.suggest(2)
    theirs = json.loads((tmp_path / "e.json").read_text())["evidence"]["suggestions"]
    assert len(found) == 2 and [(s.slice, s.area) for s in found] == [(s["slice"], s["area"]) for s in theirs]
    for s in found:
        assert np.allclose(result.image.index_to_world([s.index])[0], s.world) and round(s.index[0]) == s.slice


def test_reconstruct(tmp_path, program):
    cloud = tmp_path / "cloud.ply"
    run(program, "phantom", "torus", "--size", 32, "--count", 3000, "-o", tmp_path / "i.nrrd", "--points", cloud)
    run(program, "reconstruct", cloud, "-o", tmp_path / "t.vdb", "--mesh", tmp_path / "t.ply")
    result = covol.reconstruct(cloud)
    theirs = covol.read_mesh(tmp_path / "t.ply")
    assert np.array_equal(theirs.vertices, result.mesh.vertices) and result.mesh.measure()["genus"] == 1
    assert result.mesh.attributes["distance_to_points"].shape == (len(theirs.vertices),)
    assert np.array_equal(covol.reconstruct(covol.read_points(cloud).array).mesh.vertices, theirs.vertices)
    with pytest.raises(covol.Error, match="image"):
        _ = result.mask


def test_a_cloud_in_a_national_grid(tmp_path):
    z = np.linspace(-1, 1, 2000)
    turn = np.arange(2000) * 2.399963
    ball = 5 * np.stack((np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z), axis=1)
    place = np.array((500000.0, 5400000.0, 300.0))
    mesh = covol.reconstruct(ball + place).mesh
    assert mesh.vertices.dtype == np.float64
    assert np.abs(np.linalg.norm(mesh.vertices - place, axis=1) - 5).max() < 0.02
    again = covol.Mesh(mesh.vertices, mesh.faces)
    assert np.abs(again.vertices - mesh.vertices).max() < 1e-4 and abs(again.measure()["volume"] / mesh.measure()["volume"] - 1) < 1e-5
    mesh.save(tmp_path / "m.ply")
    assert np.abs(covol.read_mesh(tmp_path / "m.ply").vertices - mesh.vertices).max() < 1e-6


def test_every_flag_is_an_option(program):
    """Keywords have the names of the flags, so that docs/commands describes both; the flags without a keyword are listed here."""
    flags = {}
    for command in described(program)["commands"]:
        if command["name"] in ("segment", "reconstruct"):
            for group in command["groups"]:
                for option in group["options"] if group["name"] != "Help" else []:
                    for flag in option["names"].split(", "):
                        if flag.startswith("--"):
                            flags[flag[2:].replace("-", "_")] = option
    ours = covol.options()
    assert set(ours) <= set(flags)
    words = {"points_space", "points_order", "points_scale", "points", "contours", "painted", "painted_as", "painted_outside", "inside", "outside", "guess", "init",
             "spacing"}
    files = {"output", "mask", "mask_label", "rtstruct", "mesh", "density", "fields", "table", "evidence", "suggest", "suggestions", "structure_column", "half", "up", "unit_scale",
             "channel", "frame", "correct_level_shift", "points_channels", "plain",
             # Options for files, which separate functions read and write.
             "report", "keep_failed", "usda", "compression", "study"}
    later = {"brick_voxels", "brick_overlap", "seam_tolerance", "checkpoint", "checkpoint_every", "resume"}
    unknown = set(flags) - set(ours) - words - files - later
    assert not unknown, f"flags without a keyword: {sorted(unknown)}"
    for name, default in ours.items():  # numbers in the program's help are also the defaults of the Python module
        shown = flags[name]["default"]
        try:
            number = float(shown)
        except ValueError:
            continue
        assert default is None or float(default) == number, (name, default, shown)


def test_mesh_and_mask(tmp_path, solved, sphere):
    image, _, labels = sphere
    coarse = covol.mesh(solved, target_edge="3vx")
    assert len(coarse.faces) < len(solved.mesh.faces) / 3 and coarse.measure()["closed"]
    assert np.array_equal(covol.mask(solved.surface, image, label=7), 7 * solved.mask)
    assert covol.compare(solved, image_of(labels, image))["dice"] > 0.99
    assert covol.compare(solved.mesh, solved)["mean_distance"] < 0.1 * solved.surface.voxel_size
    assert covol.compare(labels, labels)["dice"] == 1
    for name in ("s.vdb", "s.ply", "s.nrrd"):
        solved.save(tmp_path / name)
    assert covol.compare(tmp_path / "s.nrrd", solved)["dice"] > 0.99
    assert np.array_equal(covol.mesh(tmp_path / "s.vdb").vertices, covol.mesh(solved.surface).vertices)
    solved.mesh.save(tmp_path / "up.ply", y_up=True)
    solved.mesh.save(tmp_path / "up.glb")  # glTF is y up; read_mesh() turns it back
    solved.surface.save(tmp_path / "half.vdb", half=True)
    assert (tmp_path / "half.vdb").stat().st_size < (tmp_path / "s.vdb").stat().st_size
    rotated = solved.mesh.vertices[:, [0, 2, 1]] * (1, 1, -1)
    assert np.allclose(covol.read_mesh(tmp_path / "up.ply").vertices, rotated, atol=1e-6)
    assert np.allclose(covol.read_mesh(tmp_path / "up.glb").vertices, solved.mesh.vertices, atol=1e-6)
    with pytest.raises(covol.Error) as error:
        covol.mask(solved, image, label=0)
    assert error.value.field == "label"


def image_of(labels, like):
    return covol.Image(labels, spacing=like.spacing, origin=like.origin, direction=like.direction)


def test_contours_paint_and_guesses(sphere):
    """Other kinds of marks are passed to the library."""
    image, points, labels = sphere
    angles = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    lines = []
    for k in (9, 14, 19, 24, 29):
        z = image.index_to_world([(k, 0, 0)])[0][2]
        r = np.sqrt(0.64 - z * z)
        lines.append(np.stack([r * np.cos(angles), r * np.sin(angles), np.full(24, z)], 1))
    assert dice(covol.segment(image, contours=lines).mask, labels) > 0.96
    painted = np.zeros_like(labels)
    painted[8:33:6] = 3 * labels[8:33:6]
    assert dice(covol.segment(image, painted=painted).mask, labels) > 0.96
    # A mask with label 5, shifted by three voxels, as a wrong result of another program.
    shifted = np.roll(labels, 3, axis=2) * 5
    corrected = covol.segment(image, points, guess=shifted).mask
    assert set(np.unique(corrected)) == {0, 5} and dice(corrected, labels) > dice(shifted, labels) + 0.05
    from_mask = covol.segment(image, points, init=covol.Image(labels, spacing=image.spacing, origin=image.origin))
    assert dice(from_mask.mask, labels) > 0.98
    around = 1.1 * np.concatenate([np.eye(3), -np.eye(3)])
    seeds = covol.segment(image, points, inside=[[0, 0, 0]], outside=around)
    assert seeds.report["seeds"] == {"inside": 1, "outside": 6, "wrong": 0, "wrong_inside": 0, "wrong_outside": 0}


def test_paint_on_the_outside_and_in_places(sphere):
    image, points, labels = sphere
    painted = np.zeros_like(labels)
    painted[17:22, 18:22, 18:22], painted[2:4, 2:6, 2:6] = 4, 9
    result = covol.segment(image, points, painted=painted, painted_outside=9, painted_as="scribbles")
    seeds = result.report["seeds"]
    assert seeds["outside"] == 32 and seeds["inside"] > 50 and seeds["wrong"] == 0
    with pytest.raises(covol.Error, match="expected the outside label 3 among its labels, got 4"):
        covol.segment(image, points, painted=np.where(painted == 4, painted, 0), painted_outside=3)
    with pytest.raises(covol.Error, match="structures") as error:
        covol.segment(image, points, painted=painted)
    assert error.value.field == "painted"
    with pytest.raises(covol.Error, match="painted_as: expected one of auto, slices, scribbles"):
        covol.segment(image, points, painted=painted, painted_as="strokes")


def test_a_tag_distance_that_nothing_encloses(sphere):
    image, points, _ = sphere
    with pytest.raises(covol.Error, match="expected at most the diagonal of the points' bounding box") as error:
        covol.segment(image, points, init="tag", tag_distance=3.0)
    assert (error.value.code, error.value.field) == ("invalid_options", "tag_distance")


def two_balls():
    """(Image, points by name, {name: expected voxels}) of balls that overlap."""
    n, h = 40, 0.5
    axis = h * (np.arange(n) - (n - 1) / 2)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    centers, radius = {"left": np.array((-2.5, 0, 0)), "right": np.array((2.5, 0.3, 0))}, 4.0
    away = {name: np.sqrt((x - c[0]) ** 2 + (y - c[1]) ** 2 + (z - c[2]) ** 2) for name, c in centers.items()}
    pixels = 200 * np.clip((radius - np.minimum(*away.values())) / h + 0.5, 0, 1)
    count = 150  # number of marks on each ball
    up = 1 - (2 * np.arange(count) + 1) / count
    turn = np.pi * (3 - 5 ** 0.5) * np.arange(count)
    normals = np.stack([np.sqrt(1 - up ** 2) * np.cos(turn), np.sqrt(1 - up ** 2) * np.sin(turn), up], axis=1)
    image = covol.Image(pixels.astype(np.float32), spacing=(h,) * 3, origin=(axis[0],) * 3)
    expected = {name: (away[name] < radius) & (away[name] <= np.minimum(*away.values())) for name in centers}
    return image, {name: c + radius * normals for name, c in centers.items()}, expected


def test_several_structures(tmp_path, program):
    image, points, expected = two_balls()
    found = covol.structures(image, points, rho=0)
    assert list(found) == ["left", "right"] and [r.label for r in found.values()] == [1, 2]
    for n, (name, result) in enumerate(found.items(), 1):
        assert np.array_equal(found.mask == n, result.mask > 0) and dice(result.mask, expected[name]) > 0.97
        assert result.report["fit"]["points_to_surface"]["bias"] > 0.05 and result.report["fit"]["marks_off"]["count"] > 0
    (overlap,) = found.overlaps
    assert overlap["structures"] == ("left", "right") and overlap["volume"] > 10
    # The program covol gives the same result from files.
    covol.save_mask(tmp_path / "i.nrrd", np.asarray(image.array, np.uint8), image)
    for name, marks in points.items():
        np.savetxt(tmp_path / f"{name}.xyz", marks, "%.17g")
    run(program, "segment", tmp_path / "i.nrrd", "--points", *(f"{name}={tmp_path / name}.xyz" for name in points), "--rho", 0,
        "-o", tmp_path / "s.vdb", "--mesh", tmp_path / "s.ply", "--mask", tmp_path / "m.nrrd", "--json", tmp_path / "r.json")
    assert np.array_equal(covol.read_image(tmp_path / "m.nrrd").array, found.mask)
    reported = json.loads((tmp_path / "r.json").read_text())["structures"]
    assert [s["fit"] for s in reported] == [r.report["fit"] for r in found.values()]


def test_structures_from_paint_seeds_and_names():
    image, points, expected = two_balls()
    painted = np.zeros(image.shape, np.uint8)
    painted[::4][expected["left"][::4]], painted[::4][expected["right"][::4]] = 7, 3
    found = covol.structures(image, painted=painted, rho=0)
    assert {name: r.label for name, r in found.items()} == {"label3": 3, "label7": 7}
    assert set(np.unique(found.mask)) == {0, 3, 7} and dice(found.mask == 7, expected["left"]) > 0.95
    found = covol.structures(image, {"left": {"points": points["left"], "outside": [(2.5, 0.3, 0)]},
                                     "right": {"points": points["right"], "init": found["label3"]}}, rho=0)
    assert found["left"].report["seeds"]["outside"] == 1 and dice(found["right"].mask, expected["right"]) > 0.9
    with pytest.raises(covol.Error, match="'ponts'") as error:
        covol.structures(image, {"left": {"ponts": points["left"]}})
    assert error.value.field == "marks"
    with pytest.raises(covol.Error, match="^far: "):
        covol.structures(image, {"left": points["left"], "far": {"inside": [(100, 0, 0)]}})
    with pytest.raises(covol.Error, match="structure"):
        covol.structures(image)


def test_timelapse():
    image, points, _ = two_balls()
    frames = [np.roll(image.array, n, axis=0) for n in range(3)]  # each frame is shifted by a voxel along z
    geometry = {"spacing": image.spacing, "origin": image.origin}
    first = {"left": points["left"]}
    requested = []

    def read():
        for frame in (frames[0], np.zeros((0, 3, 3)), *frames[1:]):
            requested.append(len(requested))
            yield frame

    found = covol.timelapse(read(), {**first, "right": points["right"]}, **geometry)
    next(found)
    assert requested == [0]
    failed, second, third = found
    assert isinstance(failed, covol.Error) and list(third) == ["left", "right"]
    heights = [r["left"].mesh.vertices[:, 2].mean() for r in (second, third)]
    assert heights[1] - heights[0] == pytest.approx(0.5, abs=0.2)
    assert second["left"].report["input"]["points"]["count"] == 0
    # A single structure; the second frame has marks of its own.
    alone = list(covol.timelapse([frames[0], (frames[1], points["left"] + (0, 0, 0.5))], points["left"], rho=0, **geometry))
    assert [r.report["input"]["points"]["count"] for r in alone] == [len(points["left"])] * 2
    assert alone[1].mesh.vertices[:, 2].mean() == pytest.approx(0.5, abs=0.1)
    with pytest.raises(TypeError, match="detla"):
        next(covol.timelapse(frames, points["left"], detla=1))


def test_shown_in_notebooks(solved, sphere):
    cloud = covol.Points("<b>", [[0, 0, 0]], None, None, None, 1.0, False, None)
    for thing in (solved, solved.mesh, solved.surface, sphere[0], cloud):
        page = thing._repr_html_()
        assert page.startswith("<div>") and page.endswith("</div>") and "<b></b>" not in page
        assert repr(thing).startswith("<covol.")
    assert "genus 0" in solved._repr_html_() and "&lt;b&gt;" in page


def test_the_stub_is_up_to_date():
    script = HERE.parents[1] / "tools/python/write_stub.py"
    done = subprocess.run([sys.executable, "-B", script], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    text = script.with_name("covol").joinpath("__init__.pyi").read_text()
    for name in covol.__all__:
        assert f"def {name}(" in text or f"class {name}" in text, f"{name} is not in __init__.pyi"
        assert getattr(covol, name).__doc__, f"{name} has no docstring"
    for type_ in (covol.Image, covol.Points, covol.Mesh, covol.LevelSet, covol.Result):
        for name, member in vars(type_).items():
            assert name.startswith("_") or member.__doc__, f"{type_.__name__}.{name} has no docstring"


def test_the_example(tmp_path):
    done = subprocess.run([sys.executable, DATA.parent / "11_python.py"], capture_output=True, text=True, cwd=tmp_path,
                          env={**os.environ, "COVOL_OUT": str(tmp_path)})
    assert done.returncode == 0, done.stderr
    for name in ("embryo.vdb", "embryo.ply", "embryo_mask.tif"):
        assert (tmp_path / "python" / name).stat().st_size > 1000 and name in done.stdout
    inside = int(done.stdout.split("voxels inside")[0].split()[-1])
    assert covol.read_image(tmp_path / "python/embryo_mask.tif").array.sum() == inside
