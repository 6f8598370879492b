"""Image, Points, Mesh, LevelSet and options, for the functions of _covol.py: arrays and files."""
import ast
import difflib
import os
import re

import numpy as np

from . import _files
from ._errors import Error
from ._program import Folder, info_of, run

_SIGNATURES = os.path.join(os.path.dirname(os.path.abspath(__file__)), "__init__.pyi")


class Call:
    """Settings for running a function."""

    def __init__(self, progress, log, threads, memory_limit):
        if isinstance(threads, bool) or not isinstance(threads, int) or threads < 0:
            raise Error(f"threads: expected >= 0, got {threads}", "invalid_options", "threads")
        self.progress, self.log, self.threads, self.memory_limit = progress, log, threads, memory_limit


# ---- options --------------------------------------------------------------------------------------------------------


def list_options():
    """The options of segment() and reconstruct(): (name, type, default), from __init__.pyi."""
    with open(_SIGNATURES, encoding="utf-8") as file:
        text = file.read()
    block = text.split("# options, from covol.options()")[1].split("# end of options")[0]
    found = re.findall(r"^ +(\w+): (.+?) = (.+),$", block, re.M)
    return [(name, kind, ast.literal_eval(default)) for name, kind, default in found]


def flag(name, value):
    """The flag for a keyword: `--tag-distance=3vx`."""
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (str, int, float, np.number)):
        raise Error(f"{name}: expected a number or a string, got {value!r}", "invalid_options", name)
    return f"--{name.replace('_', '-')}={value if isinstance(value, str) else repr(float(value)) if isinstance(value, float) else value}"


def flags_of(function, options):
    """Flags for the options that are not None. Raises TypeError for an unknown name."""
    known = {name: kind for name, kind, _ in list_options()}
    flags = []
    for name, value in options.items():
        if name not in known:
            near = difflib.get_close_matches(name, known, 1)
            raise TypeError(f"{function}() got an unexpected option '{name}'" + (f"; did you mean '{near[0]}'?" if near else ""))
        if value is None:
            continue
        kind = known[name]
        if "ArrayLike" in kind:
            flags += [f"--{name.replace('_', '-')}=" + ",".join(repr(float(x)) for x in row) for row in positions(name, value)]
        elif "_Box" in kind or "_Vector" in kind:
            try:
                numbers = np.asarray(value, float)
            except (TypeError, ValueError):
                numbers = np.zeros(0)
            if numbers.shape != ((2, 3) if "_Box" in kind else (3,)):
                raise Error(f"{name}: expected {'two corners, ((x0, y0, z0), (x1, y1, z1))' if '_Box' in kind else 'three numbers'}, "
                            f"got {value!r}", "invalid_options", name)
            flags.append(f"--{name.replace('_', '-')}=" + ",".join(repr(float(x)) for x in numbers.ravel()))
        else:
            is_whole = isinstance(value, (int, np.integer)) or isinstance(value, (float, np.floating)) and float(value).is_integer()
            if kind.startswith("int") and not is_whole:
                raise Error(f"{name}: expected a whole number, got {value!r}", "invalid_options", name)
            flags.append(flag(name, value))
    return flags


# ---- arrays ---------------------------------------------------------------------------------------------------------


def positions(name, value):
    """(n, 3) doubles. Raises Error."""
    try:
        places = np.asarray(value, float)
    except (TypeError, ValueError):
        raise Error(f"{name}: expected numbers, got {value!r}", "invalid_input", name) from None
    if places.size == 0:
        return np.zeros((0, 3))
    if places.ndim == 1 and len(places) == 3:
        places = places[None]
    if places.ndim != 2 or places.shape[1] != 3:
        raise Error(f"{name}: expected shape (n, 3), got {places.shape}", "invalid_input", name)
    if not np.all(np.isfinite(places)):
        raise Error(f"{name}: expected finite numbers", "invalid_input", name)
    return places


def _three(name, value, default):
    numbers = np.asarray(default if value is None else value, float)
    numbers = np.broadcast_to(numbers, 3) if numbers.ndim == 0 else numbers
    if numbers.shape != (3,):
        raise Error(f"{name}: expected three numbers, got {value!r}", "invalid_options", name)
    return tuple(float(x) for x in numbers)


def _plain(array):
    """Converts to a type that files support: 64-bit integers become 32-bit ones if they fit, otherwise doubles."""
    kind = array.dtype
    if kind == bool:
        return array.astype(np.uint8)
    if kind.kind in "iu" and kind.itemsize == 8:
        for small in (np.int32, np.uint32):
            limits = np.iinfo(small)
            if array.size and array.min() >= limits.min and array.max() <= limits.max:
                return array.astype(small)
        return array.astype(np.float64)
    if kind.kind in "iu" or kind in (np.float32, np.float64):
        return array.astype(kind.newbyteorder("="), copy=False)
    if kind.kind == "f":
        return array.astype(np.float32 if kind.itemsize < 4 else np.float64)
    raise Error(f"image: expected numbers, got an array of {kind}", "invalid_input", "image")


class Image:
    """A 3D image with its geometry: Image(array, spacing=, origin=, direction=, unit=), as for segment(). Raises Error."""

    def __init__(self, array, *, spacing=None, origin=None, direction=None, unit=""):
        array = np.asarray(array)
        if array.ndim != 3 or not array.size:
            raise Error(f"image: expected shape (nz, ny, nx), got {array.shape}", "invalid_input", "image")
        self._array, self._file, self._folder = _plain(array), None, None
        self.spacing = _three("spacing", spacing, 1)
        if min(self.spacing) <= 0:
            raise Error(f"spacing: expected > 0, got {self.spacing}", "invalid_options", "spacing")
        self.origin = _three("origin", origin, 0)
        matrix = np.eye(3) if direction is None else np.asarray(direction, float)
        if matrix.size != 9:
            raise Error(f"direction: expected shape (3, 3), got {matrix.shape}", "invalid_options", "direction")
        self.direction, self.unit, self.spacing_known, self.path = matrix.reshape(3, 3), unit, True, ""

    @classmethod
    def _of_file(cls, path, spacing, channel, frame, roi, correct_level_shift, call, folder=None):
        """Reads the header now, and the voxels when they are needed. @param folder  that contains the file"""
        made = cls.__new__(cls)
        path = "./" + path if path.startswith("-") else path  # the program would treat it as an option
        words = [path]
        if spacing is not None:
            words.append("--spacing=" + ",".join(repr(x) for x in _three("spacing", spacing, 1)))
        words += [f"--channel={channel}"] if channel is not None else []
        words += [f"--frame={frame}"] if frame is not None else []
        words += ["--correct-level-shift"] if correct_level_shift else []
        own = Folder()
        made._array, made._file, made._folder, made.path = None, words, folder, path
        if roi is not None:  # parts of an image are passed to the program as a separate file
            box = np.asarray(roi, float)
            if box.shape != (2, 3):
                raise Error(f"roi: expected two corners, got {roi!r}", "invalid_options", "roi")
            run(["convert", path, own.file("part.nrrd"), *words[1:], "--roi=" + ",".join(repr(float(x)) for x in box.ravel())], call, own)
            made._file, made._folder = [own.file("part.nrrd")], own
        about = info_of(*made._file, call=call)["image"]
        made.spacing, made.origin, made.unit = tuple(about["spacing"]), tuple(about["origin"]), about.get("unit", "")
        made.direction = np.array(about["direction"], float).reshape(3, 3)
        made.spacing_known = bool(np.all(about.get("spacing_known", True)))
        made._shape, made._type = tuple(reversed(about["size"])), about["type"]
        return made

    @property
    def array(self):
        """(nz, ny, nx), read-only."""
        if self._array is None:
            own = Folder()
            run(["convert", self._file[0], own.file("voxels.nrrd"), *self._file[1:]], None, own)
            self._array = _files.read_nrrd(own.file("voxels.nrrd"))
        view = self._array.view()
        view.flags.writeable = False
        return view

    def __array__(self, dtype=None, copy=None):
        return self.array if dtype is None else self.array.astype(dtype)

    @property
    def shape(self):
        """(nz, ny, nx)"""
        return self._shape if self._array is None else self._array.shape

    @property
    def dtype(self):
        """Type of the voxels."""
        if self._array is not None:
            return self._array.dtype
        return np.dtype({"float": "float32", "double": "float64"}.get(self._type, self._type))

    def _matrix(self):
        return np.asarray(self.direction) * np.asarray(self.spacing)

    def index_to_world(self, index):
        """Positions (x, y, z), shape (n, 3), of voxels (z, y, x), shape (n, 3)."""
        return positions("index", index)[:, ::-1] @ self._matrix().T + np.asarray(self.origin)

    def world_to_index(self, world):
        """Voxels (z, y, x), shape (n, 3), of positions (x, y, z), shape (n, 3)."""
        return np.linalg.solve(self._matrix(), (positions("world", world) - np.asarray(self.origin)).T).T[:, ::-1]

    def _words(self, folder, name):
        """Arguments of the program for this image."""
        return list(self._file) if self._file else [self._path(folder, name)]

    def _path(self, folder, name):
        """A file with this image: its original file if the image is that file unchanged."""
        if self._file and len(self._file) == 1:
            return self._file[0]
        _files.write_nrrd(folder.file(name), self)
        return folder.file(name)


class Points:
    """Marks or a cloud, as read from a file: see read_points()."""

    def __init__(self, name, given, lines, space, order, scale, closed, normals):
        for word, choices, what in ((space, ("world", "index", "index1", "ras", "local"), "points_space"), (order, ("xyz", "zyx"), "points_order")):
            if word is not None and word not in choices:
                raise Error(f"{what}: expected one of {', '.join(choices)}, got {word!r}", "invalid_options", what)
        parts = [positions(name, part) for part in lines] if lines is not None else [positions(name, given)]
        turned = [part[:, ::-1] if order == "zyx" else part for part in parts]
        self._lines = lines is not None
        self._parts = [part * (1.0 if space in ("index", "index1") else scale) for part in turned]
        self._file, self.source, self.space = None, name, space or "world"
        self.rule = f"{order or 'xyz'} in {self.space}"
        self.normals = None
        if normals is not None:
            unit = positions("normals", normals)
            self.normals = unit[:, ::-1] if order == "zyx" else unit
            if len(self.normals) != len(self._parts[0]) or self.space != "world":
                raise Error(f"normals: expected one for each point, both in world units, got {len(self.normals)} for "
                            f"{len(self._parts[0])} points in space '{self.space}'", "invalid_input", "normals")

    @classmethod
    def _of_file(cls, path, space, order, scale, channels):
        made = cls.__new__(cls)
        path = "./" + path if path.startswith("-") else path
        flags = [f"--points-space={space}"] if space is not None else []
        flags += [f"--points-order={order}"] if order is not None else []
        flags += [f"--points-scale={scale!r}"] if scale != 1 else []
        flags += [f"--points-channels={channels}"] if channels != 1 else []
        about = info_of(path, *flags).get("points", {})
        made._file, made._flags, made._parts, made._lines, made.normals = path, flags, None, "lines" in about, None
        made.source, made.space, made.rule = path, about.get("space", "world"), about.get("rule", "")
        made._count = about.get("count", 0)
        return made

    @property
    def array(self):
        """(n, 3), x, y, z in `space`; for a file, in the world."""
        return self.to_world() if self._file else np.concatenate(self._parts) if self._parts else np.zeros((0, 3))

    @property
    def lines(self):
        """The lines of contours: a list of arrays (n, 3)."""
        return self._parts if self._lines and self._parts is not None else []

    def __len__(self):
        return self._count if self._file else sum(map(len, self._parts))

    def __array__(self, dtype=None, copy=None):
        return self.array if dtype is None else self.array.astype(dtype)

    def to_world(self, image=None):
        """(n, 3), x, y, z in the world; positions in voxels require the image. Raises Error."""
        if self._file:
            own = Folder()
            like = ["--like", image._path(own, "like.nrrd")] if image is not None else []
            run(["convert", self._file, own.file("world.csv"), *self._flags, *like], None, own)
            return _files.read_positions(own.file("world.csv"))
        found = [self._world(part, image) for part in self._parts]
        return np.concatenate(found) if found else np.zeros((0, 3))

    def _world(self, part, image):
        if self.space == "world":
            return part
        if self.space == "ras":
            return part * (-1, -1, 1)
        if image is None:
            raise Error(f"points: positions in space '{self.space}' need the image", "invalid_input", "points_space")
        if self.space == "local":
            return part @ np.asarray(image.direction).T + np.asarray(image.origin)
        return image.index_to_world((part - (1 if self.space == "index1" else 0))[:, ::-1])

    def _path(self, folder, name, image):
        """A file from which the program reads these positions."""
        if self._file and not self._flags:
            return self._file
        path = folder.file(name + ".csv")
        if self._file:
            _files.write_positions(path, self.to_world(image))
        elif self.normals is not None:
            path = folder.file(name + ".ply")
            _files.write_ply(path, self._parts[0], normals=self.normals)
        elif self._lines:
            _files.write_positions(path, None, [self._world(part, image) for part in self._parts])
        else:
            _files.write_positions(path, self.to_world(image))
        return path


class Mesh:
    """Triangles: Mesh(vertices, faces). Raises Error."""

    def __init__(self, vertices, faces):
        self.vertices = np.asarray(positions("vertices", vertices))
        self.faces = np.asarray(faces)
        if self.faces.ndim != 2 or self.faces.shape[1] != 3 or self.faces.dtype.kind not in "iu":
            raise Error(f"faces: expected whole numbers of shape (m, 3), got {self.faces.dtype} {self.faces.shape}", "invalid_input", "faces")
        if self.faces.size and (self.faces.min() < 0 or self.faces.max() >= len(self.vertices)):
            raise Error(f"faces: expected 0 to {len(self.vertices) - 1}, got {self.faces.min()} to {self.faces.max()}", "invalid_input", "faces")
        self.faces = self.faces.astype(np.uint32)
        self._normals, self._file, self._folder, self.attributes = None, None, None, {}

    @classmethod
    def _read(cls, path, folder):
        made = cls.__new__(cls)
        columns, made.faces = _files.read_ply(path)
        made.vertices = np.stack([columns.pop(name) for name in "xyz"], 1)
        made._normals = np.stack([columns.pop(name) for name in ("nx", "ny", "nz")], 1)
        made.attributes, made._file, made._folder = columns, path, folder
        return made

    @property
    def normals(self):
        """(n, 3) float32, unit vectors at the vertices."""
        if self._normals is None:
            own = Folder()
            run(["convert", self._path(own, "mesh.ply"), own.file("again.ply")], None, own)
            self._normals = Mesh._read(own.file("again.ply"), own)._normals
        return self._normals

    def measure(self):
        """dict: volume, area (world units), components, genus, closed, manifold."""
        own = Folder()
        return info_of(self._path(own, "mesh.ply"))["mesh"]

    def save(self, path, *, y_up=None, unit_scale=1.0):
        """Writes .ply, .obj, .stl, .off or .glb, which is y-up by default; y_up overrides this. Raises Error."""
        own = Folder()
        up = [] if y_up is None else [f"--up={'y' if y_up else 'z'}"]
        run(["convert", self._path(own, "mesh.ply"), os.fspath(path), *up, f"--unit-scale={unit_scale!r}"], None, own)

    def _path(self, folder, name):
        if self._file:
            return self._file
        path = folder.file(os.path.splitext(name)[0] + ".ply")
        _files.write_ply(path, self.vertices, self.faces)
        return path


def file_and_grid(source):
    """Splits FILE.vdb[:GRID] as the program does, so that names of files and folders may contain colons."""
    file, colon, grid = source.partition(".vdb:")
    return (file + ".vdb", grid) if colon and not os.path.exists(source) else (source, "")


class LevelSet:
    """A level set of OpenVDB, negative inside; accepted by mesh(), mask(), compare(), init= and guess=."""

    def __init__(self, path, folder):
        self._source, self._folder, self._facts = path, folder, None

    def _about(self):
        if self._facts is None:
            file, grid = file_and_grid(self._source)
            grids = info_of(file)["grids"]
            found = [g for g in grids if g["name"] == grid] or grids
            self._facts = found[0]
        return self._facts

    @property
    def voxel_size(self):
        """World units."""
        size = self._about()["voxel_size"]
        return float(size[0] if isinstance(size, list) else size)

    @property
    def box(self):
        """Two opposite corners of the domain, world units."""
        return tuple(self._about()["min"]), tuple(self._about()["max"])

    def save(self, path, *, half=False):
        """Writes a .vdb; half: values as 16-bit floats. Raises Error."""
        from ._covol import copy_level_set
        copy_level_set(self._source, os.fspath(path), half)

    def _path(self, folder, name):
        return self._source
