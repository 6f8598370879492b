"""Runs inside Blender: installs the add-on from its zip, segments with the children of an empty as marks and with the vertices of
a mesh, repeats it, then segments a time-lapse.

    blender -b --factory-startup --python tests/cli/blender_addon.py -- ADDON.zip IMAGE POINTS.xyz MOVIE FOLDER

Writes FOLDER/addon.json: {what: whether it holds}, and further facts.
"""
import json
import pathlib
import sys

import bpy
import numpy as np
from mathutils import Matrix

archive, image, points, movie, folder = (pathlib.Path(word) for word in sys.argv[sys.argv.index("--") + 1:])
checks = {}
bpy.ops.preferences.addon_install(filepath=str(archive))
bpy.ops.preferences.addon_enable(module="covol_blender")
settings = bpy.context.scene.covol
places = np.loadtxt(points)
settings.image, settings.folder, settings.scale = str(image), str(folder), 0.5


def corners(obj):
    local = np.array([vertex.co for vertex in obj.data.vertices])
    turn = np.array(obj.matrix_world)
    return local @ turn[:3, :3].T + turn[:3, 3]


def volume_box(obj, threshold=0.01):
    """The bounding box of the volume's surface in the world, by Blender's own modifier, which shifts a surface by half a voxel."""
    target = bpy.data.objects.new("of volume", bpy.data.meshes.new("of volume"))
    bpy.context.collection.objects.link(target)
    modifier = target.modifiers.new("of volume", "VOLUME_TO_MESH")
    modifier.object, modifier.grid_name, modifier.threshold, modifier.resolution_mode = obj, "density", threshold, "GRID"
    made = target.evaluated_get(bpy.context.evaluated_depsgraph_get())
    found = np.array([made.matrix_world @ v.co for v in made.to_mesh().vertices])
    bpy.data.objects.remove(target)
    return found.min(0), found.max(0)


def error(call, *words, **keywords):
    try:
        call(*words, **keywords)
    except RuntimeError as found:  # Blender reports the error of an operator to scripts as a RuntimeError
        return str(found)
    return ""


# The marks are children of an empty object with a rotation and a translation of its own, so that the add-on must use
# their world positions. The first run creates an object, settings.space, that represents the image's coordinate system.
holder = bpy.data.objects.new("holder", None)
bpy.context.scene.collection.objects.link(holder)
holder.matrix_world = Matrix.Translation((7, 8, 9)) @ Matrix.Rotation(0.3, 4, "X")
settings.marks = holder
checks["no marks is said"] = "no marks" in error(bpy.ops.covol.segment)
for place in places:
    mark = bpy.data.objects.new("mark", None)
    bpy.context.scene.collection.objects.link(mark)
    mark.parent = holder
    mark.matrix_world = Matrix.Translation(0.5 * place)
bpy.context.view_layer.update()
checks["runs"] = bpy.ops.covol.segment() == {"FINISHED"}
space = settings.space
bpy.context.view_layer.update()
surface = next(child for child in space.children if child["covol_role"] == "surface")
volume = next(child for child in space.children if child["covol_role"] == "volume")
low, high = 0.5 * places.min(0), 0.5 * places.max(0)
found = corners(surface)
checks["the surface is where the marks are"] = np.allclose(found.min(0), low, atol=0.3) and np.allclose(found.max(0), high, atol=0.3)
box = volume_box(volume)
checks["the volume is where the surface is"] = np.allclose(box[0], found.min(0), atol=0.4) and np.allclose(box[1], found.max(0), atol=0.4)
checks["grids"] = {grid.name for grid in volume.data.grids} == {"density", "surface"}
checks["smooth"] = all(polygon.use_smooth for polygon in surface.data.polygons)
checks["figures"] = surface["covol_genus"] == 0 and surface["covol_volume"] > 0 and "genus 0" in settings.status
first = {path.name for path in folder.iterdir()}
checks["files"] = sum(name.endswith((".vdb", ".ply", ".json")) for name in first) == 3

# The user moves the space and gives the surface a material. The next run uses other marks, the vertices of a mesh on a
# body of half the size; it must update the existing surface object and keep its material and the new position of the
# space.
surface.data.materials.append(bpy.data.materials.new("glass"))
space.matrix_world = Matrix.Translation((100, 0, 0)) @ Matrix.Rotation(0.5, 4, "Z") @ Matrix.Scale(2, 4)
cloud = bpy.data.meshes.new("cloud")
middle = places.mean(0)
cloud.from_pydata((middle + 0.5 * (places - middle)).tolist(), [], [])
vertices = bpy.data.objects.new("vertices", cloud)
bpy.context.scene.collection.objects.link(vertices)
vertices.matrix_world = space.matrix_world
settings.marks, settings.image = vertices, ""
bpy.context.view_layer.update()
before, objects = surface["covol_volume"], set(bpy.data.objects)
checks["again"] = bpy.ops.covol.segment() == {"FINISHED"}
bpy.context.view_layer.update()
checks["no further object"] = set(bpy.data.objects) == objects and len(surface.data.materials) == 1
checks["an eighth of the volume"] = abs(surface["covol_volume"] / before - 1 / 8) < 0.02
turned = corners(surface)
middle_there = np.array(space.matrix_world) @ (*middle, 1)
checks["turned with its space"] = np.allclose((turned.min(0) + turned.max(0)) / 2, middle_there[:3], atol=0.5)
second = {path.name for path in folder.iterdir()}
checks["files of the last result are gone"] = len([n for n in second if n.endswith(".vdb")]) == 1 and not first & second & {pathlib.Path(
    bpy.path.abspath(volume.data.filepath)).name}

# A time-lapse of three images, shown from Blender's frame 5 on. The body moves by one unit of the image along x from
# each image to the next.
cloud.clear_geometry()
cloud.from_pydata(places.tolist(), [], [])
settings.image, settings.is_lapse = str(movie), True
scene = bpy.context.scene
scene.frame_set(5)
bpy.context.view_layer.update()
checks["a time-lapse runs"] = bpy.ops.covol.segment() == {"FINISHED"} and settings.status.startswith("3 of 3 frames")


def local_middle(obj):
    return np.mean([vertex.co for vertex in obj.data.vertices], 0)


def at(frame):
    """Positions of surface and volume in a frame of Blender, in units of the space."""
    scene.frame_set(frame)
    bpy.context.view_layer.update()
    box = np.mean(volume_box(volume), 0)
    return local_middle(surface), (np.linalg.inv(np.array(space.matrix_world)) @ (*box, 1))[:3]


seen = {frame: at(frame) for frame in (1, 5, 6, 7, 9)}
for n, what in enumerate(("the surface", "the volume")):
    moved = [seen[frame][n] - seen[5][n] for frame in (1, 5, 6, 7, 9)]
    checks[f"{what} moves with the frames"] = np.allclose(moved, [(0, 0, 0), (0, 0, 0), (1, 0, 0), (2, 0, 0), (2, 0, 0)], atol=0.25)
checks["both are at one place"] = np.allclose(seen[7][0], seen[7][1], atol=0.5)
checks["a sequence"] = volume.data.is_sequence and volume.data.frame_duration == 3 and volume.data.frame_start == 5
checks["figures of the frame"] = surface["covol_volume"] == surface.data["covol_volume"]
checks["each frame has the material"] = all(len(bpy.data.meshes[name].materials) == 1 for name in surface["covol_meshes"].splitlines())
series = {path.name for path in folder.iterdir()}
checks["files of the frames"] = sum(name.endswith(".vdb") for name in series) == sum(name.endswith(".ply") for name in series) == 3
meshes = len(bpy.data.meshes)
scene.frame_set(6)
checks["a time-lapse again"] = bpy.ops.covol.segment() == {"FINISHED"} and len(bpy.data.meshes) == meshes
settings.image, settings.is_lapse = str(image), False
bpy.context.view_layer.update()
checks["one image after it"] = bpy.ops.covol.segment() == {"FINISHED"} and not volume.data.is_sequence
checks["its meshes and files are gone"] = len(bpy.data.meshes) == meshes - 2 and not series & {path.name for path in folder.iterdir()}
checks["it stays in other frames"] = np.allclose(at(9)[0], places.mean(0), atol=0.3)
second = {path.name for path in folder.iterdir()}
settings.image, settings.is_lapse = "", True
checks["a time-lapse of no image"] = "choose one" in error(bpy.ops.covol.segment)
settings.is_lapse = False

# Wrong settings: each is reported as the operator's error, and the existing objects and files remain.
settings.options = "--no-such-option"
checks["an option that is none"] = "--no-such-option" in error(bpy.ops.covol.segment)
settings.options = "--model 'paper"
checks["a quote that does not end"] = "options: --model 'paper: " in error(bpy.ops.covol.segment)
settings.options, settings.image = "", str(folder / "none.tif")
checks["no image"] = "none.tif" in error(bpy.ops.covol.segment)
settings.image, settings.folder = "", "//covol"
checks["no folder"] = "save the .blend file" in error(bpy.ops.covol.segment)
bpy.context.preferences.addons["covol_blender"].preferences.program = "/nowhere/covol"
settings.folder = str(folder)
checks["no program"] = "/nowhere/covol" in error(bpy.ops.covol.segment)
checks["nothing was left by them"] = {path.name for path in folder.iterdir()} == second
settings.marks = None
bpy.context.scene.cursor.location = (1, 2, 3)
bpy.ops.covol.add_mark()
bpy.ops.covol.add_mark()
bpy.context.view_layer.update()
checks["a mark at the cursor"] = [tuple(child.matrix_world.translation) for child in settings.marks.children] == [(1, 2, 3)] * 2
bpy.ops.preferences.addon_disable(module="covol_blender")
checks["unregistered"] = not hasattr(bpy.types.Scene, "covol")
(folder / "addon.json").write_text(json.dumps({what: bool(holds) for what, holds in checks.items()}))
