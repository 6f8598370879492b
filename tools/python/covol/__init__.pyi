# Types of the module covol; documentation is in the docstrings of covol/__init__.py. The options between the marker lines
# are written by tools/python/write_stub.py.
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, Literal, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

__version__: str

_Vector = Union[Sequence[float], NDArray[Any]]  # three numbers, x, y, z
_Box = Union[Sequence[_Vector], NDArray[Any]]  # two corners
_Length = Union[float, str]  # world units, or voxels as in "3vx"
_Path = Union[str, "os.PathLike[str]"]
_Progress = Callable[[str, float], object]
_Space = Literal["world", "index", "index1", "ras", "local"]
_Order = Literal["xyz", "zyx"]

class Error(Exception):
    code: Literal["invalid_options", "invalid_input", "io", "unsupported", "numerical", "cancelled"]
    field: str | None
    def __init__(self, message: str, code: str = ..., field: str | None = ...) -> None: ...

class Image:
    def __init__(
        self,
        array: ArrayLike,
        *,
        spacing: _Vector | None = ...,
        origin: _Vector | None = ...,
        direction: ArrayLike | None = ...,
        unit: str = ...,
    ) -> None: ...
    @property
    def array(self) -> NDArray[Any]: ...
    def __array__(self, dtype: Any = ...) -> NDArray[Any]: ...
    @property
    def shape(self) -> Tuple[int, int, int]: ...
    @property
    def dtype(self) -> np.dtype[Any]: ...
    @property
    def spacing(self) -> Tuple[float, float, float]: ...
    @property
    def origin(self) -> Tuple[float, float, float]: ...
    @property
    def direction(self) -> NDArray[np.float64]: ...
    @property
    def affine(self) -> NDArray[np.float64]: ...
    @property
    def unit(self) -> str: ...
    @property
    def spacing_known(self) -> bool: ...
    @property
    def path(self) -> str: ...
    def index_to_world(self, index: ArrayLike) -> NDArray[np.float64]: ...
    def world_to_index(self, world: ArrayLike) -> NDArray[np.float64]: ...
    def _repr_html_(self) -> str: ...

class Points:
    def __len__(self) -> int: ...
    @property
    def array(self) -> NDArray[np.float64]: ...
    def __array__(self, dtype: Any = ...) -> NDArray[Any]: ...
    @property
    def normals(self) -> NDArray[np.float64] | None: ...
    @property
    def lines(self) -> list[NDArray[np.float64]]: ...
    @property
    def space(self) -> str: ...
    @property
    def rule(self) -> str: ...
    @property
    def source(self) -> str: ...
    def to_world(self, image: Image | None = ...) -> NDArray[np.float64]: ...
    def _repr_html_(self) -> str: ...

class Mesh:
    def __init__(self, vertices: ArrayLike, faces: ArrayLike) -> None: ...
    @property
    def vertices(self) -> NDArray[np.float32] | NDArray[np.float64]: ...
    @property
    def faces(self) -> NDArray[np.uint32]: ...
    @property
    def normals(self) -> NDArray[np.float32]: ...
    @property
    def attributes(self) -> dict[str, NDArray[np.float32]]: ...
    def measure(self) -> dict[str, Any]: ...
    def save(self, path: _Path, *, y_up: bool | None = ..., unit_scale: float = ...) -> None: ...
    def _repr_html_(self) -> str: ...

class LevelSet:
    @property
    def voxel_size(self) -> float: ...
    @property
    def box(self) -> Tuple[Tuple[float, float, float], Tuple[float, float, float]]: ...
    def save(self, path: _Path, *, half: bool = ...) -> None: ...
    def _repr_html_(self) -> str: ...

class Suggestion:
    slice: int
    index: Tuple[float, float, float]
    world: Tuple[float, float, float]
    area: float
    def __init__(
        self, slice: int, index: Tuple[float, float, float], world: Tuple[float, float, float], area: float
    ) -> None: ...

class Result:
    @property
    def surface(self) -> LevelSet: ...
    @property
    def mesh(self) -> Mesh: ...
    @property
    def mask(self) -> NDArray[Any]: ...
    @property
    def image(self) -> Image | None: ...
    @property
    def marks(self) -> NDArray[np.float64]: ...
    @property
    def report(self) -> dict[str, Any]: ...
    @property
    def warnings(self) -> list[str]: ...
    @property
    def log(self) -> list[str]: ...
    @property
    def name(self) -> str: ...
    @property
    def label(self) -> int: ...
    def suggest(self, count: int = ..., *, progress: _Progress | None = ..., threads: int = ...) -> list[Suggestion]: ...
    def save(self, path: _Path) -> None: ...
    def _repr_html_(self) -> str: ...

class Structures(dict[str, Result]):
    overlaps: list[dict[str, Any]]
    @property
    def mask(self) -> NDArray[Any]: ...

_ImageLike = Union[Image, ArrayLike, _Path, Any]  # Any: images of nibabel
_PointsLike = Union[Points, ArrayLike, _Path]
_LinesLike = Union[Points, Sequence[ArrayLike], _Path]
_Surface = Union[LevelSet, Result, _Path]

def segment(
    image: _ImageLike,
    points: _PointsLike | None = ...,
    *,
    contours: _LinesLike | None = ...,
    painted: _ImageLike | None = ...,
    painted_outside: int = ...,
    painted_as: Literal["auto", "slices", "scribbles"] = ...,
    inside: _PointsLike | None = ...,
    outside: _PointsLike | None = ...,
    guess: _ImageLike | LevelSet | Result | None = ...,
    init: _ImageLike | LevelSet | Result | None = ...,
    spacing: _Vector | None = ...,
    origin: _Vector | None = ...,
    direction: ArrayLike | None = ...,
    affine: ArrayLike | None = ...,
    points_space: _Space | None = ...,
    points_order: _Order | None = ...,
    points_scale: float = ...,
    progress: _Progress | None = ...,
    threads: int = ...,
    memory_limit: int = ...,
    # options, from covol.options()
    attraction_range: _Length | None = None,
    coarse_levels: int | None = None,
    contour_curve: Literal["lines", "spline"] = "spline",
    contour_thickness: _Length = 0.0,
    delta: _Length | None = None,
    edge_contrast: float | None = None,
    edge_epsilon: float = 0.02,
    edge_feature: Literal["auto", "slope", "bright-line", "dark-line"] = "auto",
    edge_k: float | None = None,
    epsilon: float = 0.01,
    exterior_seed: ArrayLike = (),
    guess_label: int = 0,
    guess_radius: _Length | None = None,
    guess_weight: float = 1.0,
    hole_distance: _Length | None = None,
    holes: Literal["auto", "close", "open", "flat"] = "auto",
    image_yields: float | None = None,
    lattice_origin: _Vector | None = None,
    margin: _Length | None = None,
    mark_precision: _Length | None = None,
    max_steps: int = 500,
    min_component: _Length = 0.0,
    model: Literal["guided", "paper"] = "guided",
    most_points: int = 2500000,
    remove_outliers: float = 0.0,
    rho: float = 1.0,
    roi: _Box | None = None,
    sigma: _Length | None = None,
    simplify: _Length = 0.0,
    smooth: Literal["none", "jets", "wlop"] = "none",
    solver_tolerance: float | None = None,
    tag_distance: _Length | None = None,
    tau: _Length | None = None,
    theta: float = 1.0,
    tolerance: float = 0.002,
    voxel_size: _Length | None = None,
    # end of options
) -> Result: ...
def structures(
    image: _ImageLike,
    marks: Mapping[str, _PointsLike | Mapping[str, Any]] | None = ...,
    *,
    painted: _ImageLike | None = ...,
    painted_outside: int = ...,
    painted_as: Literal["auto", "slices", "scribbles"] = ...,
    init: _ImageLike | LevelSet | Result | None = ...,
    spacing: _Vector | None = ...,
    origin: _Vector | None = ...,
    direction: ArrayLike | None = ...,
    affine: ArrayLike | None = ...,
    points_space: _Space | None = ...,
    points_order: _Order | None = ...,
    points_scale: float = ...,
    progress: _Progress | None = ...,
    threads: int = ...,
    memory_limit: int = ...,
    **options: Any,  # as for segment()
) -> Structures: ...
def timelapse(
    frames: Iterable[_ImageLike | Tuple[_ImageLike, Any]],
    marks: _PointsLike | Mapping[str, Any] | None = ...,
    **keywords: Any,  # as for segment()
) -> Iterator[Result | Structures | Error]: ...
def reconstruct(
    points: _PointsLike | None = ...,
    *,
    contours: _LinesLike | None = ...,
    inside: _PointsLike | None = ...,
    outside: _PointsLike | None = ...,
    init: _ImageLike | LevelSet | Result | None = ...,
    normals: ArrayLike | None = ...,
    points_space: _Space | None = ...,
    points_order: _Order | None = ...,
    points_scale: float = ...,
    progress: _Progress | None = ...,
    threads: int = ...,
    memory_limit: int = ...,
    # options, from covol.options()
    attraction_range: _Length | None = None,
    coarse_levels: int | None = None,
    contour_curve: Literal["lines", "spline"] = "spline",
    contour_thickness: _Length = 0.0,
    delta: _Length | None = None,
    edge_contrast: float | None = None,
    edge_epsilon: float = 0.02,
    edge_feature: Literal["auto", "slope", "bright-line", "dark-line"] = "auto",
    edge_k: float | None = None,
    epsilon: float = 0.01,
    exterior_seed: ArrayLike = (),
    guess_label: int = 0,
    guess_radius: _Length | None = None,
    guess_weight: float = 1.0,
    hole_distance: _Length | None = None,
    holes: Literal["auto", "close", "open", "flat"] = "auto",
    image_yields: float | None = None,
    lattice_origin: _Vector | None = None,
    margin: _Length | None = None,
    mark_precision: _Length | None = None,
    max_steps: int = 500,
    min_component: _Length = 0.0,
    model: Literal["guided", "paper"] = "guided",
    most_points: int = 2500000,
    remove_outliers: float = 0.0,
    rho: float = 0.0,
    roi: _Box | None = None,
    sigma: _Length | None = None,
    simplify: _Length = 0.0,
    smooth: Literal["none", "jets", "wlop"] = "none",
    solver_tolerance: float | None = None,
    tag_distance: _Length | None = None,
    tau: _Length | None = None,
    theta: float = 1.0,
    tolerance: float = 0.002,
    voxel_size: _Length | None = None,
    # end of options
) -> Result: ...
def read_image(
    path: _Path,
    *,
    spacing: _Vector | None = ...,
    channel: int | None = ...,
    frame: int | None = ...,
    roi: _Box | None = ...,
    correct_level_shift: bool = ...,
    progress: _Progress | None = ...,
    threads: int = ...,
    memory_limit: int = ...,
) -> Image: ...
def read_points(
    path: _Path,
    *,
    points_space: _Space | None = ...,
    points_order: _Order | None = ...,
    points_scale: float = ...,
    points_channels: int = ...,
) -> Points: ...
def read_study(folder: _Path) -> dict[str, dict[str, Points | Image | LevelSet | str]]: ...
def read_study_options(folder: _Path) -> dict[str, float | str]: ...

class Study:
    url: str
    folder: str
    image: Image
    @property
    def is_open(self) -> bool: ...
    @property
    def marks(self) -> dict[str, dict[str, Points | Image | LevelSet | str]]: ...
    @property
    def options(self) -> dict[str, float | str]: ...
    @property
    def result(self) -> Structures: ...
    def close(self) -> None: ...
    def __enter__(self) -> Study: ...
    def __exit__(self, *_: object) -> None: ...
    def _repr_html_(self) -> str: ...

def mark(
    volume: _ImageLike,
    marks: ArrayLike | Mapping[str, Any] | None = ...,
    *,
    study: _Path | None = ...,
    spacing: _Vector | None = ...,
    origin: _Vector | None = ...,
    direction: ArrayLike | None = ...,
    affine: ArrayLike | None = ...,
    notebook: str | Iterable[str] | None = ...,
    program: _Path | None = ...,
    height: int = ...,
) -> Study: ...
def read_level_set(path: _Path) -> LevelSet: ...
def read_mesh(path: _Path) -> Mesh: ...
def mesh(
    surface: _Surface,
    *,
    isovalue: _Length = ...,
    min_component: _Length = ...,
    target_edge: _Length = ...,
    adaptive: _Length = ...,
    smooth: int = ...,
    repair: bool = ...,
    progress: _Progress | None = ...,
    threads: int = ...,
) -> Mesh: ...
def mask(
    surface: _Surface,
    like: _ImageLike,
    *,
    label: int = ...,
    spacing: _Vector | None = ...,
    origin: _Vector | None = ...,
    direction: ArrayLike | None = ...,
    affine: ArrayLike | None = ...,
    progress: _Progress | None = ...,
    threads: int = ...,
) -> NDArray[np.uint8]: ...
def save_mask(path: _Path, voxels: ArrayLike, like: _ImageLike) -> None: ...
def compare(
    a: _ImageLike | Mesh | LevelSet | Result,
    b: _ImageLike | Mesh | LevelSet | Result,
    *,
    label: int = ...,
    label_b: int | None = ...,
    spacing: _Vector | None = ...,
    origin: _Vector | None = ...,
    direction: ArrayLike | None = ...,
    affine: ArrayLike | None = ...,
    progress: _Progress | None = ...,
    threads: int = ...,
) -> dict[str, float]: ...
def distances(
    points: ArrayLike, surface: Mesh | LevelSet | Result, *, progress: _Progress | None = ..., threads: int = ...
) -> dict[str, float]: ...
def suggest(
    result: Result, count: int = ..., *, progress: _Progress | None = ..., threads: int = ...
) -> list[Suggestion]: ...
def phantom(
    kind: str = ..., size: int = ..., points: int = ..., noise: float = ..., seed: int = ...
) -> Tuple[Image, NDArray[np.float64], NDArray[np.uint8]]: ...
def options() -> dict[str, Any]: ...
def from_affine(affine: ArrayLike) -> Tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]: ...
def to_affine(img: Image) -> NDArray[np.float64]: ...
