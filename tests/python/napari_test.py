"""The napari plugin, as far as it can be tested without napari: its manifest, and the conversion of layers."""
import ast
import pathlib
import re
import sys
from types import SimpleNamespace as Layer

import numpy as np
import pytest
import yaml

import covol
from conftest import dice

PLUGIN = pathlib.Path(__file__).resolve().parents[2] / "tools/napari"
sys.path.insert(0, str(PLUGIN))
from covol_napari import layers  # noqa: E402

TURN = np.array([[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1.0]])  # a rotation in the plane of the first two axes


def manifest():
    return yaml.safe_load((PLUGIN / "covol_napari/napari.yaml").read_text())


def test_manifest_rules():
    """The requirements of npe2 for a manifest: names, ids of commands, their functions."""
    m = manifest()
    assert re.fullmatch(r"[A-Za-z0-9](?:[A-Za-z0-9._-]*[A-Za-z0-9])?", m["name"])
    assert 3 <= len(m["display_name"]) <= 90 and m["display_name"] == m["display_name"].strip()
    assert set(m) <= {"name", "display_name", "contributions", "schema_version", "on_activate", "icon"}
    commands = {c["id"]: c for c in m["contributions"]["commands"]}
    for name, command in commands.items():
        assert set(command) <= {"id", "title", "python_name", "enablement", "category", "icon", "short_title"}
        assert name.startswith(m["name"] + ".") and re.fullmatch(r"(([a-zA-Z0-9][\w-]*)\.)+[a-zA-Z0-9_]+", name)
        module, function = re.fullmatch(r"([\w.]+):(\w+)", command["python_name"]).groups()
        source = (PLUGIN / (module.replace(".", "/") + ".py")).read_text()
        assert function in [n.name for n in ast.parse(source).body if isinstance(n, (ast.FunctionDef, ast.ClassDef))]
        assert command["title"]
    for widget in m["contributions"]["widgets"]:
        assert set(widget) == {"command", "display_name"} and widget["command"] in commands


def test_the_package_names_its_manifest():
    text = (PLUGIN / "pyproject.toml").read_text()
    assert f'[project.entry-points."napari.manifest"]\n{manifest()["name"]} = "covol_napari:napari.yaml"' in text
    assert f'name = "{manifest()["name"]}"' in text and 'covol_napari = ["napari.yaml"]' in text
    assert f'version = "{covol.__version__}"' in text
    compile((PLUGIN / "covol_napari/widget.py").read_text(), "widget.py", "exec")


def test_transforms():
    """Against the composition affine @ (rotate @ shear @ scale, translate), written out for one point."""
    affine = np.eye(4)
    affine[:3, :3], affine[:3, 3] = TURN, (1, 2, 3)
    layer = Layer(scale=[2, 0.5, 0.25], translate=[10, 20, 30], rotate=TURN.T, shear=[0.1, 0.2, 0.3],
                  affine=Layer(affine_matrix=affine))
    z, y, x = 2 * 7.0, 0.5 * 8.0, 0.25 * 9.0
    z, y, x = z + 0.1 * y + 0.2 * x, y + 0.3 * x, x
    z, y, x = 0.8 * z + 0.6 * y, -0.6 * z + 0.8 * y, x
    z, y, x = z + 10, y + 20, x + 30
    z, y, x = 0.8 * z - 0.6 * y + 1, 0.6 * z + 0.8 * y + 2, x + 3
    assert np.allclose(layers.transform_of(layer) @ (7, 8, 9, 1), (z, y, x, 1))
    assert np.allclose(layers.world_of(layer, [[7, 8, 9]]), [[x, y, z]])
    of_four = Layer(scale=[1, 2, 0.5, 0.25], translate=[0, 10, 20, 30], rotate=np.eye(4), shear=np.zeros(6), affine=np.eye(5))
    assert np.allclose(layers.transform_of(of_four) @ (1, 1, 1, 1), (12, 20.5, 30.25, 1))
    assert np.array_equal(layers.transform_of(Layer()), np.eye(4))


@pytest.fixture(scope="module")
def scene():
    """A ball in an image layer that is scaled, rotated and moved, with marks in a layer with a transform of its own."""
    k, j, i = np.mgrid[0:24, 0:36, 0:40]
    # Distance from the centre of the ball, in voxels along the last two axes; the radius is 12.
    r = np.sqrt(((k - 12) * 1.5)**2 + (j - 18)**2 + (i - 20)**2)
    labels = (r < 12).astype(np.uint8)
    image = Layer(data=np.clip(128 - 40 * (r - 12), 0, 255).astype(np.uint8), name="cells", scale=[3, 2, 2],
                  translate=[5, -7, 11], rotate=TURN, shear=np.zeros(3), affine=np.eye(4))
    n = np.arange(80) + 0.5
    phi, theta = np.arccos(1 - 2 * n / 80), np.pi * (1 + 5**0.5) * n
    on_sphere = 12 * np.stack([np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta) * np.sin(phi)], 1)
    voxels = (12, 18, 20) + on_sphere / (1.5, 1, 1)
    world = voxels * (3, 2, 2) @ TURN.T + (5, -7, 11)
    return image, labels, voxels, world


def test_segment(scene):
    image, labels, _, world = scene
    points = Layer(data=world / 0.5 - 3, scale=[0.5] * 3, translate=[1.5] * 3)
    (mask, about, kind), ((vertices, faces), _, surface), *more = layers.segment(image, points, suggestions=2)
    assert (kind, surface) == ("labels", "surface") and dice(mask, labels) > 0.97
    assert np.allclose(about["affine"], layers.transform_of(image)) and about["metadata"]["covol"]["surface"]["closed"]
    middle = np.array([12, 18, 20]) * (3, 2, 2) @ TURN.T + (5, -7, 11)
    assert np.linalg.norm(vertices.mean(0) - middle) < 0.5
    a, b, c = (vertices[faces[:, n]].astype(float) for n in range(3))
    # volume; positive if the triangles face outward.
    assert np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6 == pytest.approx(4 / 3 * np.pi * 24**3, rel=0.03)
    for positions, meta, kind in more:
        assert kind == "points" and positions.shape[1] == 3 and len(meta["features"]["area"]) == len(positions)
        assert np.all(np.linalg.norm(positions - middle, axis=1) < 30)


def test_shapes_and_labels(scene):
    image, labels, _, _ = scene
    angles = np.linspace(0, 2 * np.pi, 20, endpoint=False)
    polygons = []
    for k in range(5, 20, 2):
        r = np.sqrt(144 - (1.5 * (k - 12))**2)
        polygons.append(np.stack([np.full(20, k), 18 + r * np.sin(angles), 20 + r * np.cos(angles)], 1))
    box = np.array([[12, 6, 8], [12, 6, 32], [12, 30, 32], [12, 30, 8]], float)
    same = {key: getattr(image, key) for key in ("scale", "translate", "rotate", "shear", "affine")}
    shapes = Layer(data=polygons[:3] + [box] + polygons[4:], shape_type=["polygon"] * 3 + ["ellipse"] + ["polygon"] * 4, **same)
    assert dice(layers.segment(image, shapes=shapes, suggestions=0)[0][0], labels) > 0.95
    closed, marks = layers.lines_of(Layer(data=[polygons[0], box, box], shape_type=["path", "rectangle", "line"], **same))
    assert len(closed) == 1 and len(closed[0]) == 48 and len(marks) == 24
    painted = np.zeros_like(labels)
    painted[5:20:2] = 2 * labels[5:20:2]
    assert dice(layers.segment(image, labels=Layer(data=painted, **same), suggestions=0)[0][0], labels) > 0.95


def test_more_axes(scene):
    image, _, voxels, _ = scene
    movie = Layer(data=np.stack([image.data * 0, image.data]), scale=[1, 3, 2, 2])
    assert np.array_equal(layers.voxels_of(movie, (1,)), image.data)
    marks = np.concatenate([np.insert(voxels, 0, t, axis=1) + (0, 0, t, 0) for t in (0, 1)])
    assert np.allclose(layers.world_of(Layer(), marks, (1,)), (voxels + (0, 1, 0))[:, ::-1])
    pyramid = Layer(data=[image.data, image.data[::2, ::2, ::2]], multiscale=True)
    assert layers.voxels_of(pyramid).shape == image.data.shape


@pytest.mark.parametrize("layer", [Layer(data=np.zeros((4, 4))), Layer(data=np.zeros((4, 4, 4, 3)), rgb=True)])
def test_what_is_no_image(layer):
    with pytest.raises(covol.Error, match="three axes"):
        layers.segment(layer)


def test_a_sheared_image(scene):
    """The ball is an ellipsoid in the world, and the mask has the layer's voxels."""
    image, labels, voxels, _ = scene
    sheared = Layer(data=image.data, scale=[3, 2, 2], shear=[0.5, 0, 0])
    points = Layer(data=voxels, scale=[3, 2, 2], shear=[0.5, 0, 0])
    (mask, about, _), ((vertices, _), *_), *_ = layers.segment(sheared, points, suggestions=0)
    assert dice(mask, labels) > 0.97
    assert np.allclose(about["affine"], layers.transform_of(sheared))
    assert np.linalg.norm(vertices.mean(0) - (layers.transform_of(sheared) @ (12, 18, 20, 1))[:3]) < 0.5


class Viewer:
    """The members of napari's viewer that layers.show() uses, by its documentation: `layers`, add_labels(), add_surface(), add_points()."""

    def __init__(self):
        self.layers = []

    def add(kind):
        def add(self, data, *, name, metadata, affine=None, units=None, features=None, face_color=None, size=None):
            layer = type(kind.title(), (), {})()
            layer.__dict__.update(data=data, name=name, metadata=metadata, affine=affine, units=units, features=features, visible=True)
            self.layers.append(layer)
        return add

    add_labels, add_surface, add_points = add("labels"), add("surface"), add("points")


def test_results_go_into_the_layers_of_the_last_one(scene):
    image, labels, _, world = scene
    scaled = Layer(**vars(image), units=("micrometer",) * 3)
    viewer = Viewer()
    first = layers.segment(scaled, Layer(data=world), suggestions=0)
    place = (world[:1], {"name": "cells suggested marks", "metadata": {"covol": {}}, "features": {"slice": [3]}}, "points")
    layers.show(viewer, [*first, place])
    mask, surface, places = viewer.layers
    assert [layer.units for layer in (mask, surface)] == [("micrometer",) * 3] * 2 and len(places.data) == 1
    surface.visible = False
    mine = type("Labels", (), {"name": mask.name + " 2", "metadata": {}, "data": labels})()
    viewer.layers.append(mine)
    middle = world.mean(0)
    layers.show(viewer, layers.segment(scaled, Layer(data=middle + 0.8 * (world - middle)), suggestions=0, init="tag"))
    assert viewer.layers == [mask, surface, mine] and not surface.visible and mine.data is labels
    assert dice(mask.data, labels) < 0.97 and mask.metadata["covol"]["resolved"] and len(surface.data[0]) != len(first[1][0][0])
    assert layers.units_of(Layer()) is None and layers.units_of(Layer(units=("s", "nm", "um", "um"))) == ("nm", "um", "um")


def test_a_layer_of_a_person_is_not_taken(scene):
    image, labels, _, world = scene
    viewer = Viewer()
    viewer.layers.append(type("Labels", (), {"name": "cells covol", "metadata": {}, "data": labels})())
    layers.show(viewer, layers.segment(image, Layer(data=world), suggestions=0))
    assert len(viewer.layers) == 3 and viewer.layers[0].data is labels
