"""covol finds the surface of a structure in a 3D image with the help of a few marks, and reconstructs surfaces from point clouds.

    import covol
    result = covol.segment(volume, marks, spacing=(0.35, 0.35, 1.0))
    result.mask            # uint8, of the volume's shape
    result.mesh.vertices   # (n, 3), x, y, z
    result.save("cell.vdb")

Arrays of voxels are indexed z, y, x, as in SimpleITK's GetArrayFromImage() and tifffile. Positions, `spacing`, `origin` and
`direction` are x, y, z in the image's own unit: world = origin + direction @ (spacing * (i, j, k)), in LPS if it is anatomical,
as in SimpleITK; voxel centres are at whole numbers.

Lengths among the options are in world units, or in voxels of the computation ("3vx"). Options that are None are chosen
automatically. They are listed by `covol.options()`, and in docs/commands/segment.md, where the flags have the same names.

Functions raise covol.Error, with `code` and `field`. They release the GIL while they compute, and Ctrl-C cancels them.
"""
import os

import numpy as np

try:
    from . import _covol
except ImportError as error:
    if error.name != __name__:
        raise
    raise ImportError(f"covol: {os.path.dirname(__file__)} has no _covol, the compiled part of the module: "
                      "`cmake --build build --target covol_python` builds it", name="covol._covol") from None
from . import _html, _inputs
from ._covol import Image, LevelSet, Mesh, Points, Result, __version__
from ._errors import Error
from ._mark import Study, mark
from ._inputs import from_affine, read_image, read_points, read_study, read_study_options, to_affine

__all__ = ["Error", "Image", "LevelSet", "Mesh", "Points", "Result", "Structures", "Study", "Suggestion", "compare", "distances", "from_affine", "mark", "mask",
           "mesh", "options", "phantom", "read_image", "read_level_set", "read_mesh", "read_points", "read_study", "read_study_options", "reconstruct", "save_mask",
           "segment", "structures", "suggest", "timelapse", "to_affine"]


def segment(image, points=None, *, contours=None, painted=None, painted_outside=0, painted_as="auto", inside=None, outside=None,
            guess=None, init=None, spacing=None, origin=None, direction=None, affine=None, points_space=None, points_order=None,
            points_scale=1.0, progress=None, threads=0, memory_limit=0, **options):
    """Finds the surface of a structure in a 3D image with the help of marks.

    Args:
        image: array of shape (nz, ny, nx), of integers, floats or bools, with any strides; it is not copied if its values
            have at most 32 bits or are doubles, and must not change during the call. Or an Image, a file's path, or an image of nibabel.
        points: marks on the surface, shape (n, 3); or Points, or a file.
        contours: closed lines of marks on slices: a list of arrays of shape (n, 3), Points, or a file.
        painted: label image of the image's shape with one label, painted on some slices or at some positions.
        painted_outside: a label in it that marks the outside; 0: none.
        painted_as: "auto", "slices" (complete cross-sections) or "scribbles" (inside, but incomplete).
        inside, outside: positions that are known to be inside or outside, shape (n, 3); or Points, or a file.
        guess: another program's result, which is corrected by the marks: a mask of the image's shape, a LevelSet or a file.
        init: the start of the level set, as for the flag --init: "tag", "sphere:x,y,z,r", ...; or a mask or a LevelSet.
        spacing, origin: three numbers, x, y, z, in world units; 1 and 0 by default for arrays.
        direction: 3 x 3 (or nine numbers in row-major order), whose columns are the image's axes i, j, k; orthogonal.
        affine: instead of these three, a 4 x 4 matrix from voxels (i, j, k) to RAS, as in nibabel.
        points_space: "world" (default if the file states none), "index" (voxels from 0), "index1", "ras" or "local".
        points_order: "xyz" (default if the file states none) or "zyx".
        points_scale: factor for the coordinates of points.
        progress: called with (stage, fraction) from the calling thread; exceptions that it raises cancel the computation.
        threads: maximum number of threads; 0: all cores. Results do not depend on it.
        memory_limit: maximum memory in bytes; 0: no limit.
        **options: see covol.options().

    Returns:
        Result.

    Raises:
        Error: "invalid_options" and "invalid_input" with the keyword in `field`; "io", "unsupported", "numerical".
        KeyboardInterrupt: after Ctrl-C.
    """
    marks = {"points": points, "contours": contours, "inside": inside, "outside": outside, "guess": guess}
    (result,), _ = _run("segment", image, {"": marks}, (painted, painted_outside, painted_as), init,
                        {"spacing": spacing, "origin": origin, "direction": direction, "affine": affine},
                        (points_space, points_order, points_scale), _inputs.call(progress, threads, memory_limit), options)
    return result


def structures(image, marks=None, *, painted=None, painted_outside=0, painted_as="auto", init=None, spacing=None, origin=None,
               direction=None, affine=None, points_space=None, points_order=None, points_scale=1.0, progress=None, threads=0,
               memory_limit=0, **options):
    """Finds the surfaces of several structures in one image. They are made disjoint before they are measured.

    Args:
        marks: dict by the structures' names; each value is an array of points, or a dict of arguments of segment(): points,
            contours, inside, outside, guess, init, exterior_seed, and `painted`, a label image with one label for this structure only.
        painted: label image of the image's shape. A label belongs to the structure of the same name, or to an additional one: "label3", or
            its name in a .seg.nrrd. Painted voxels of one structure are outside of the others.
        image, painted_outside, painted_as, init, spacing, origin, direction, affine, points_space, points_order, points_scale,
            progress, threads, memory_limit, **options: see segment().

    Returns:
        Structures.

    Raises:
        Error, KeyboardInterrupt: as segment(); messages about one structure begin with its name.
    """
    return Structures(*_run("structures", image, marks or {}, (painted, painted_outside, painted_as), init,
                            {"spacing": spacing, "origin": origin, "direction": direction, "affine": affine},
                            (points_space, points_order, points_scale), _inputs.call(progress, threads, memory_limit), options))


def timelapse(frames, marks=None, **keywords):
    """Segments the frames of a time-lapse one after the other: each starts from the surfaces of the last one that succeeded.

    Args:
        frames: images as for segment(), in order, or pairs (image, marks) for later frames with marks of their own. The iterable
            is consumed one by one.
        marks: of the first frame: points, a dict of arguments of segment() (points, contours, inside, outside, exterior_seed), or
            for several structures a dict of these by name, as for structures().
        **keywords: spacing and similar arguments, and options, as for segment().

    Yields:
        Result of each frame, or Structures; for a frame that failed, its Error.

    Raises:
        KeyboardInterrupt: after Ctrl-C.
    """
    lapse = _covol.TimeLapse()
    several = isinstance(marks, dict) and any(key not in ("points", "contours", "inside", "outside", "exterior_seed") for key in marks)
    geometry = {key: keywords.pop(key, None) for key in ("spacing", "origin", "direction", "affine")}
    reading = keywords.pop("points_space", None), keywords.pop("points_order", None), keywords.pop("points_scale", 1.0)
    init = keywords.pop("init", None)
    call = _inputs.call(**{key: keywords.pop(key) for key in ("progress", "threads", "memory_limit") if key in keywords})

    def go(frame):
        image, own = frame if isinstance(frame, tuple) else (frame, None if lapse.started else marks)
        own = {name: (own or {}).get(name) for name in marks} if several else {"": own}
        try:
            return _run("timelapse", image, own, (None, 0, "auto"), init, geometry, reading, call, keywords, lapse)
        except Error as error:
            return error

    # The package that runs the program covol (tools/python/program) has follow(), which passes all frames to the program at once.
    for found in lapse.follow(frames, go) if hasattr(lapse, "follow") else map(go, frames):
        yield found if isinstance(found, Error) else Structures(*found) if several else found[0][0]


def reconstruct(points=None, *, contours=None, inside=None, outside=None, init=None, normals=None, points_space=None,
                points_order=None, points_scale=1.0, progress=None, threads=0, memory_limit=0, **options):
    """Reconstructs the closed surface that a point cloud samples, without an image and without normals.

    Args:
        points: positions, shape (n, 3), in world units; or Points, or a file. Their normals are taken into account.
        normals: unit vectors, shape (n, 3), if `points` is an array. They are checked before they are used.
        contours, inside, outside, init, points_order, points_scale, progress, threads, memory_limit, **options: see segment().

    Returns:
        Result; it has no image, and therefore no mask.

    Raises:
        Error, KeyboardInterrupt: as segment().
    """
    marks = {"points": points, "contours": contours, "inside": inside, "outside": outside, "normals": normals}
    (result,), _ = _run("reconstruct", None, {"": marks}, (None, 0, "auto"), init, {}, (points_space, points_order, points_scale),
                        _inputs.call(progress, threads, memory_limit), options)
    return result


def _run(function, image, marks, painted, init, geometry, reading, call, options, lapse=None):
    """The results of all structures, and the overlaps that were resolved."""
    volume = None if function == "reconstruct" else _inputs.image(image, **geometry)
    reading = dict(zip(("points_space", "points_order", "points_scale"), reading))

    def like(value):
        """Converts a mask or similar value; arrays have the geometry of the image."""
        is_array = not (value is None or _inputs.is_path(value) or isinstance(value, (Image, LevelSet, Result)))
        own = volume is not None and is_array and not hasattr(value, "affine")
        return _inputs.shape(value, **({key: getattr(volume, key) for key in ("spacing", "origin", "direction")} if own else {}))

    paint = _inputs.image(painted[0]) if _inputs.is_path(painted[0]) else like(painted[0])
    return _covol.run(function, volume, {str(name): _inputs.marks(own, reading, like) for name, own in marks.items()},
                      (paint, *painted[1:]), like(init), options, call, lapse)


class Structures(dict):
    """The result of structures(): a dict of Results by name.

    Attributes:
        overlaps: dicts that describe overlaps of two structures that were resolved: "structures" (two names), "volume" (world
            units^3) and, if one was removed from the other, "inner".
    """

    def __init__(self, results, overlaps):
        super().__init__((result.name, result) for result in results)
        names = list(self)
        self.overlaps = [{"structures": (names[a], names[b]), "volume": volume, **({} if inner is None else {"inner": names[inner]})}
                         for a, b, volume, inner in overlaps]

    @property
    def mask(self):
        """Labels of the image's shape: Result.label if a voxel's centre is inside, otherwise 0."""
        values = np.array([0, *(result.label for result in self.values())])
        return values.astype(np.min_scalar_type(values.max()))[_covol.label_image(list(self.values()), _inputs.call())]


def mesh(surface, *, isovalue=0.0, min_component=0.0, target_edge=0.0, adaptive=0.0, smooth=0, repair=False, progress=None,
         threads=0):
    """Extracts a closed, manifold, outward oriented mesh of a level set.

    Args:
        surface: LevelSet, Result or the path of a .vdb file.
        isovalue: offset of the level from the surface, a length; > 0: outside.
        min_component: components smaller than a cube of this edge are removed.
        target_edge: > 0: decimate to about this edge length.
        adaptive: > 0: decimate as long as no triangle is farther than this from the level set; at most "2vx".
        smooth: steps of volume-preserving smoothing.
        repair: resolve self-intersections, fill holes.

    Returns:
        Mesh. Raises Error.
    """
    return _covol.mesh(_level_set(surface), isovalue, min_component, target_edge, adaptive, smooth, repair,
                       _inputs.call(progress, threads))


def mask(surface, like, *, label=1, spacing=None, origin=None, direction=None, affine=None, progress=None, threads=0):
    """Label image of a level set: `label` if a voxel's centre is inside, otherwise 0.

    Args:
        surface: LevelSet, Result or the path of a .vdb file.
        like: Image, array or file with the voxels of the mask, as in segment().
        label: 1 to 255.

    Returns:
        uint8 array of shape (nz, ny, nx). Raises Error.
    """
    lattice = _inputs.image(like, spacing, origin, direction, affine)
    return _covol.mask(_level_set(surface), lattice, label, _inputs.call(progress, threads))


def compare(a, b, *, label=0, label_b=None, spacing=None, origin=None, direction=None, affine=None, progress=None, threads=0):
    """Computes overlap and surface distances of two solids.

    Args:
        a, b: masks (arrays, Images), Mesh, LevelSet, Result, or files of these, in any combination.
        label: of masks; 0: any label. label_b: of b, if it differs.
        spacing, origin, direction, affine: of arrays, as in segment().

    Returns:
        dict with dice, jaccard, volume_a, volume_b, and symmetric distances hausdorff, hausdorff95, mean_distance, in world
        units. Raises Error.
    """

    def solid(value):
        if isinstance(value, Result):
            return value.surface
        if isinstance(value, (Image, Mesh, LevelSet)):
            return value
        return os.fspath(value) if _inputs.is_path(value) else _inputs.image(value, spacing, origin, direction, affine)

    return _covol.compare(solid(a), solid(b), label, label if label_b is None else label_b, _inputs.call(progress, threads))


def distances(points, surface, *, progress=None, threads=0):
    """Distances of points, shape (n, 3), from a surface (Mesh, LevelSet or Result): dict with mean, p95 and max, world units."""
    triangles = surface if isinstance(surface, Mesh) else surface.mesh if isinstance(surface, Result) else mesh(surface)
    return _covol.distances(points, triangles, _inputs.call(progress, threads))


class Suggestion:
    """A slice on which marks would improve the result.

    Attributes:
        slice: its index along z, from 0.
        index: (z, y, x), the position in it that is expected to improve the result most, in voxels.
        world: (x, y, z), the same in the world.
        area: the part of the surface that marks along the outline there would support, world units^2.
    """

    __slots__ = ("slice", "index", "world", "area")

    def __init__(self, slice, index, world, area):
        self.slice, self.index, self.world, self.area = slice, index, world, area

    def __repr__(self):
        return f"Suggestion(slice={self.slice}, index=({_html.numbers(self.index)}), area={self.area:.4g})"


def suggest(result, count=3, *, progress=None, threads=0):
    """The slices of an image on which new marks would improve the result most, best first: a list of at most `count` Suggestions."""
    return [Suggestion(*found) for found in _covol.Result._suggest(result, count, _inputs.call(progress, threads))]


def read_level_set(path):
    """The LevelSet of a .vdb file; "FILE.vdb:NAME" selects one of several. Raises Error."""
    return _covol.read_level_set(os.fspath(path))


def read_mesh(path):
    """The Mesh of a PLY, OBJ, STL, OFF or GLB file. Raises Error."""
    return _covol.read_mesh(os.fspath(path))


def save_mask(path, voxels, like):
    """Writes labels, an array of the shape of the Image `like`, in its geometry: .nrrd, .nii, .nii.gz, .mha, .tif."""
    _covol.save_mask(os.fspath(path), voxels, _inputs.image(like))


def phantom(kind="sphere", size=128, points=3000, noise=0.0, seed=1):
    """A test shape: (Image, points of shape (n, 3), its true labels of the image's shape); kinds as for `covol phantom`."""
    return _covol.phantom(kind, size, points, noise, seed)


def options():
    """The options of segment() and reconstruct() and their defaults; None: chosen automatically. reconstruct() has rho = 0."""
    return {name: default for name, _, default in _covol.list_options()}


def _level_set(surface):
    if isinstance(surface, Result):
        return surface.surface
    return read_level_set(surface) if _inputs.is_path(surface) else surface


# ---- members that are added to the types of the extension module ------------------------------------------------------------


def _once(make):
    """A property that is computed on first access."""
    name = "_made_" + make.__name__

    def get(self):
        if name not in self.__dict__:
            self.__dict__[name] = make(self)
        return self.__dict__[name]

    return property(get, doc=make.__doc__)


def _result_report(self):
    """The report that `covol segment --json` writes: a dict."""
    return self._report()


def _result_mask(self):
    """uint8 array of the image's shape: 1 inside. If the guess was a mask, its own labels, corrected."""
    return self._mask(_inputs.call())


def _save_result(self, path):
    """Writes the level set (.vdb), the mesh (.ply, .obj, .stl, .off, .glb) or the mask (as save_mask()), depending on the ending."""
    path = os.fspath(path)
    ending = os.path.splitext(path.lower())[1]
    if ending == ".vdb":
        self.surface.save(path)
    elif ending in (".ply", ".obj", ".stl", ".off", ".glb"):
        self.mesh.save(path)
    else:
        save_mask(path, self.mask, self.image)


Result.report = _once(_result_report)
Result.mask = _once(_result_mask)
Result.warnings = property(lambda self: self.report["warnings"], doc="Warnings: what should be checked by eye, as texts.")
Result.suggest = suggest
Result.save = _save_result
Result.__repr__ = lambda self: "<covol.Result: volume {volume:.5g}, area {area:.5g}>".format(**self.report["surface"])
Result._repr_html_ = _html.result
Image.affine = property(to_affine, doc="4 x 4, voxels (i, j, k) to RAS, as nibabel has it.")
Image.__repr__ = lambda self: f"<covol.Image {self.shape} {self.dtype}, spacing {_html.numbers(self.spacing)} {self.unit}>"
Image._repr_html_ = _html.image
Points.__repr__ = lambda self: f"<covol.Points: {len(self)} in {self.space}>"
Points._repr_html_ = _html.points
Mesh.__repr__ = lambda self: f"<covol.Mesh: {len(self.vertices)} vertices, {len(self.faces)} faces>"
Mesh._repr_html_ = _html.mesh
LevelSet.__repr__ = lambda self: f"<covol.LevelSet: voxels of {self.voxel_size:.5g}>"
LevelSet._repr_html_ = _html.level_set
read_image.__doc__ = """Reads a 3D image in its own number type.

Args:
    path: TIFF, OME-Zarr, NRRD, NIfTI, MetaImage, DICOM, MRC, ICS, HDF5, NumPy or .vdb, see docs/formats.md.
    spacing: instead of the file's. channel, frame: of images with several. roi: two corners in world coordinates.

Returns:
    Image: array (z, y, x; uses the memory of the file if that is mapped), spacing, origin, direction, unit. Raises Error.
"""
read_points.__doc__ = """Reads marks or a cloud: tables, marks of Fiji, napari, 3D Slicer and ITK-SNAP, PLY, OBJ, PCD, LAS.

Args:
    path: see docs/formats.md. points_space, points_order, points_scale, points_channels: instead of those that the format defines.

Returns:
    Points: array of shape (n, 3) in its `space`, lines, normals; to_world(image) returns world positions. Raises Error.
"""
read_study.__doc__ = """The structures and marks of a study of `covol mark`; structures(image, read_study(folder)) computes their surfaces.

Args:
    folder: of the study, for example "stack.tif.covol".

Returns:
    dict of the marks of each structure by its name. Each is a dict with Points for the keys "points", "contours", "inside" and
    "outside", an Image for the key "painted", and an Image, a LevelSet or the path of a mesh for the key "guess"; keys without a
    value are missing. Positions are in world coordinates. Raises Error.
"""
read_study_options.__doc__ = """The options of a study: structures(image, read_study(folder), **read_study_options(folder)).

Args:
    folder: of the study.

Returns:
    dict of keywords: voxel_size, rho, mark_precision and model, without those that the study does not set. Raises Error.
"""
for _type in (Error, Study, mark, Image, LevelSet, Mesh, Points, Result, Structures, Suggestion, read_image, read_points, read_study, read_study_options, from_affine,
              to_affine):
    _type.__module__ = "covol"
del _type
