"""Replaces the compiled module for covol/__init__.py by the program covol and files: for every Python from 3.9 on.

Images in files are not read here: their paths are passed to the program. Arrays are written to a temporary folder, which exists
as long as the objects that use it. Results are bitwise identical to the program's.
"""
import os
import shutil

import numpy as np

from . import _files, _program, _study, _values
from ._errors import Error
from ._lapse import Frames
from ._program import PROGRAM, Folder, read_json, run as run_program  # noqa: F401 - PROGRAM is for covol.mark()
from ._values import Call, Image, LevelSet, Mesh, Points, file_and_grid, list_options  # noqa: F401
from ._version import __version__  # noqa: F401

_WITHOUT = "%s: not available in this package, which runs the program covol; %s"


class Result:
    """The result of segment() and reconstruct()."""

    def __init__(self, folder, name, report, image, marks, log, again):
        self._folder, self._json, self._again = folder, report, again
        self.name, self.label, self.image, self.marks, self.log = name, report.get("label", 1), image, marks, log

    @property
    def _grid(self):
        return self._json.get("vdb_grid") or "surface"

    @property
    def surface(self):
        """The LevelSet: a signed distance, world units."""
        return LevelSet(f"{self._folder.file('surface.vdb')}:{self._grid}", self._folder)

    @property
    def mesh(self):
        """The Mesh: manifold, outward; closed unless holes are left open."""
        path = self._folder.file("mesh.ply" if not self.name else f"mesh_{self._grid}.ply")
        return Mesh._read(path, self._folder)

    def _report(self):
        return self._json

    def _mask(self, call):
        if self.image is None:
            raise Error("mask: expected an image, got points alone", "invalid_input")
        voxels = _files.read_nrrd(self._folder.file("mask.nrrd"))
        return voxels if not self.name else (voxels == self.label).astype(np.uint8)

    def _suggest(self, count, call):
        """Runs the program again, because it prints suggestions only when it segments."""
        if not isinstance(count, int) or count < 0:
            raise Error(f"count: expected >= 0, got {count}", "invalid_options", "count")
        if self.image is None:
            raise Error("suggest: expected an image, got points alone", "invalid_input")
        if count == 0:
            return []
        if self._again is None:
            raise Error(_WITHOUT % ("suggest", "the page of covol.mark() shows where marks would help"), "unsupported")
        report = self._again(count, call)
        found = [e for e in report.get("structures", [report]) if e.get("name", "") in ("", self.name)][0]
        return [(s["slice"], tuple(reversed(s["index"])), tuple(s["world"]), s["area"])
                for s in found.get("evidence", {}).get("suggestions", [])]


def run(function, image, structures, painted, init, options, call, lapse):
    """Runs segment(), structures() and reconstruct(). Returns (results, overlaps)."""
    if lapse is not None:
        return lapse.add(image, structures, None if init is None else _start(init, lapse.folder, "init.nrrd"), options, call)
    flags = _values.flags_of(function, options)
    command = "reconstruct" if function == "reconstruct" else "segment"
    if not structures and painted[0] is None:
        raise Error("marks: expected a structure, got none", "invalid_input", "marks")
    folder = Folder()
    words = [command] if image is None else [command, *image._words(folder, "image.nrrd")]
    for n, (name, own) in enumerate(structures.items()):
        words += _words_of(folder, n, name, own, image, command)
    if painted[0] is not None:
        words += ["--painted", painted[0]._path(folder, "painted.nrrd")]
        words += [f"--painted-outside={painted[1]}"] if painted[1] else []
        words += [f"--painted-as={painted[2]}"] if painted[2] != "auto" else []
    if init is not None:
        words.append("--init=" + _start(init, folder, "init.nrrd"))
    job = [*words, *flags]
    outputs = ["-o", folder.file("surface.vdb"), "--mesh", folder.file("mesh.ply"), "--json", folder.file("report.json")]
    if image is not None:
        outputs += ["--mask", folder.file("mask.nrrd")]
    log = run_program([*job, *outputs], call, folder)

    def again(count, call):
        made = Folder()
        run_program([*job, f"--suggest={count}", "-o", made.file("surface.vdb"), "--json", made.file("report.json")], call, folder)
        return read_json(made.file("report.json"))

    return _results(folder, read_json(folder.file("report.json")), image, structures, log, again)


def solve_study(image, study, options, call):
    """Segments the structures of a study of `covol mark`. Returns (results, overlaps)."""
    folder = Folder()
    log = run_program(["segment", "--study", study, *_values.flags_of("structures", options), "-o", folder.file("surface.vdb"), "--mesh",
                       folder.file("mesh.ply"), "--mask", folder.file("mask.nrrd"), "--json", folder.file("report.json")], call, folder)
    return _results(folder, read_json(folder.file("report.json")), image, {}, log, None)


def _results(folder, report, image, structures, log, again):
    """The results of a run, from its files. @param again  runs the program again with --suggest"""
    report.setdefault("warnings", [])
    report.pop("options", None)  # contains paths of the temporary folder
    for name in ("paths", "rules"):
        report.get("input", {}).get("points", {}).pop(name, None)
    entries = report.get("structures")
    if not entries:
        marks = _marks(next(iter(structures.values()), {}), image)
        return [Result(folder, next(iter(structures), ""), report, image, marks, log, again)], []
    results = []
    for entry in entries:
        own = {**{key: report[key] for key in ("warnings", "seconds") if key in report}, **entry}
        results.append(Result(folder, entry["name"], own, image, _marks(structures.get(entry["name"], {}), image), log, again))
    names = [entry["name"] for entry in entries]
    overlaps = [(names.index(o["structures"][0]), names.index(o["structures"][1]), o["volume"],
                 names.index(o["inner"]) if "inner" in o else None) for o in report.get("overlaps", [])]
    return results, overlaps


class TimeLapse(Frames):
    """The frames of timelapse()."""

    def found(self, *of_frame):
        return _results(*of_frame, None)


def _marks(own, image):
    found = [cloud.to_world(image) for cloud in own.get("points", [])]
    return np.concatenate(found) if found else np.zeros((0, 3))


def _words_of(folder, n, name, own, image, command):
    """The command-line options for one structure's marks."""
    prefix = f"{name}=" if name else ""
    words = []
    for kind in ("points", "contours", "inside", "outside"):
        for m, cloud in enumerate(own[kind]):
            path = cloud._path(folder, f"{kind}_{n}_{m}", image)
            if kind == "points" and command == "reconstruct":
                words.append(path)
            else:
                words += [f"--{kind}", prefix + path]
    if own["guess"] is not None:
        words += ["--guess", prefix + _solid(own["guess"], folder, f"guess_{n}.nrrd")]
    if own["init"] is not None:
        words.append("--init=" + _start(own["init"], folder, f"init_{n}.nrrd"))
    if own["painted"] is not None:
        words += ["--painted", prefix + own["painted"]._path(folder, f"painted_{n}.nrrd")]
    if own["exterior_seed"] is not None:
        for x, y, z in np.asarray(own["exterior_seed"], float).reshape(-1, 3):
            words.append(f"--exterior-seed={name + ':' if name else ''}{x!r},{y!r},{z!r}")
    return words


def _solid(value, folder, name):
    """The path of a mask, a level set, a mesh or a file."""
    return value if isinstance(value, str) else value._path(folder, name)


def _start(value, folder, name):
    if isinstance(value, str):
        return value
    return ("vdb:" if isinstance(value, LevelSet) else "mask:") + value._path(folder, name)


def label_image(results, call):
    """The number of the result at each voxel, from 1; 0 outside of all."""
    first = results[0]
    if first.image is None:
        raise Error("mask: expected an image, got points alone", "invalid_input")
    voxels = _files.read_nrrd(first._folder.file("mask.nrrd"))
    numbers = np.zeros(max(256, int(voxels.max()) + 1), np.uint8)
    for n, result in enumerate(results):
        numbers[result.label] = n + 1
    return numbers[voxels]


def mesh(surface, isovalue, min_component, target_edge, adaptive, smooth, repair, call):
    folder, words = Folder(), []
    for name, value in (("isovalue", isovalue), ("min_component", min_component), ("target_edge", target_edge), ("adaptive", adaptive)):
        if value != 0:
            words.append(_values.flag(name, value))
    words += [f"--smooth={smooth}"] if smooth else []
    words += ["--repair"] if repair else []
    run_program(["mesh", surface._path(folder, ""), "-o", folder.file("mesh.ply"), *words], call, folder)
    return Mesh._read(folder.file("mesh.ply"), folder)


def mask(surface, lattice, label, call):
    if not 1 <= label <= 255:
        raise Error(f"label: expected 1 to 255, got {label}", "invalid_options", "label")
    folder = Folder()
    run_program(["mask", surface._path(folder, ""), "--like", *lattice._words(folder, "like.nrrd"), "--label", label, "-o",
                 folder.file("mask.nrrd")], call, folder)
    return _files.read_nrrd(folder.file("mask.nrrd"))


def save_mask(path, voxels, image):
    voxels = np.asarray(voxels)
    if voxels.shape != image.shape:
        raise Error(f"mask: expected the shape of the image, {image.shape}, got {voxels.shape}", "invalid_input")
    folder = Folder()
    small = np.uint8 if voxels.min(initial=0) >= 0 and voxels.max(initial=0) <= 255 else np.int32
    labels = Image(voxels.astype(small), spacing=image.spacing, origin=image.origin, direction=image.direction, unit=image.unit)
    run_program(["convert", labels._path(folder, "labels.nrrd"), path], None, folder)


def compare(a, b, label, label_b, call):
    folder = Folder()
    run_program(["compare", _solid(a, folder, "a.nrrd"), _solid(b, folder, "b.nrrd"), "--label", label, "--label-b", label_b, "--json",
                 folder.file("report.json")], call, folder)
    return read_json(folder.file("report.json"))["compare"]


def distances(points, triangles, call):
    places = _values.positions("points", points)
    if not len(places):
        raise Error("points: expected positions, got none", "invalid_input", "points")
    folder = Folder()
    _files.write_positions(folder.file("points.csv"), places)
    run_program(["compare", triangles._path(folder, "surface.ply"), folder.file("points.csv"), "--json", folder.file("report.json")],
                call, folder)
    report = read_json(folder.file("report.json"))
    return report["fit"]["points_to_surface"] if "fit" in report else report["points_to_surface"]


def read_level_set(path):
    file, grid = file_and_grid(path)
    made = LevelSet(os.path.abspath(file) + (":" + grid if grid else ""), None)
    made.voxel_size  # raises an Error now if the file has no level set
    return made


def read_mesh(path):
    folder = Folder()
    run_program(["convert", path, folder.file("mesh.ply")], None, folder)
    return Mesh._read(folder.file("mesh.ply"), folder)


def read_image(path, spacing, channel, frame, roi, correct_level_shift, call):
    return Image._of_file(path, spacing, channel, frame, roi, correct_level_shift, call)


def read_points(path, space, order, scale, channels):
    return Points._of_file(path, space, order, scale, channels)


def phantom(kind, size, points, noise, seed):
    folder = Folder()
    run_program(["phantom", kind, "--size", size, "--count", points, "--noise", noise, "--seed", seed, "-o", folder.file("image.nrrd"),
                 "--points", folder.file("points.csv"), "--labels", folder.file("labels.nrrd")], None, folder)
    image = Image._of_file(folder.file("image.nrrd"), None, None, None, None, False, None, folder)
    return image, _files.read_positions(folder.file("points.csv")), _files.read_nrrd(folder.file("labels.nrrd"))


def read_study(folder):
    raise Error(_WITHOUT % ("read_study", "the command does: covol segment --study FOLDER; so does the result of covol.mark()"),
                "unsupported")


def read_study_options(folder):
    return _study.read_options(folder)


def copy_level_set(source, path, half):
    """Writes a grid of a .vdb file to a separate file."""
    if half:
        return run_program(["convert", source, path, "--half"])
    file, grid = file_and_grid(source)
    if grid in ("", "surface"):
        return shutil.copyfile(file, path)
    return run_program(["convert", source, path])
