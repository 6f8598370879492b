"""Imports the level set, fog volume and meshes of a covol job into Blender, checks that they have the same position and size, and
smooth normals, and renders mesh and volume into one picture. 13_blender.sh makes the files and calls

    blender -b --factory-startup --python houdini_free_examples/13_blender.py -- \
        OUTDIR FILE.vdb... FILE.ply FILE.glb [image=IMAGE.vdb:LOW:HIGH] [size=800x450] [checks]

With "checks" no picture is made. The picture shows the image (its grid "density" from LOW to HIGH), or, without image=, the job's
own fog volume. Writes OUTDIR/blender.json (what was measured), blender.png and blender.blend. Exit code 0: all checks hold, 1: one
does not, 2: files are missing. For Blender 3.4 (Debian 12); lengths are in the files' own unit.
"""
import json
import pathlib
import sys

import bmesh
import bpy
import numpy as np
from mathutils import Matrix, Vector
from mathutils.bvhtree import BVHTree

# The glTF importer of Blender 3.4 uses a name that numpy 1.24 no longer has.
if "bool" not in vars(np):
    np.bool = bool

MESH_TOLERANCE = 1e-5  # of the largest side, between PLY and GLB vertices: both have the same single-precision numbers
BOX_TOLERANCE = 0.5    # voxels, between the bounding boxes of a volume's surface and of the mesh
MEAN_TOLERANCE = 0.1   # voxels, mean distance of a level set's surface from the mesh
NORMAL_TOLERANCE = 1   # degrees, between the normals in the .glb file and those that Blender computes from the triangles
PICTURE = (800, 450)
SAMPLES = 16
GLOW = 16


def import_mesh(path):
    before = set(bpy.data.objects)
    if path.suffix == ".glb":
        bpy.ops.import_scene.gltf(filepath=str(path))
    else:
        bpy.ops.import_mesh.ply(filepath=str(path))
    found = next(o for o in bpy.data.objects if o not in before and o.type == "MESH")
    found.name = path.name
    return found


def import_volume(path):
    bpy.ops.object.volume_import(filepath=str(path))
    found = bpy.context.object
    if not found.data.grids.load():
        raise RuntimeError(f"{path}: {found.data.grids.error_message}")
    found.name = path.name
    return found


def corners(obj):
    """Vertices in world space, (n, 3)."""
    local = np.empty(len(obj.data.vertices) * 3, np.float32)
    obj.data.vertices.foreach_get("co", local)
    turn = np.array(obj.matrix_world)
    return local.reshape(-1, 3) @ turn[:3, :3].T + turn[:3, 3]


def volume_to_mesh(obj, grid, threshold):
    """The mesh that the modifier Volume to Mesh makes of a grid, in world space, with the grid's own voxels."""
    target = bpy.data.objects.new("from volume", bpy.data.meshes.new("from volume"))
    bpy.context.collection.objects.link(target)
    modifier = target.modifiers.new("from volume", "VOLUME_TO_MESH")
    modifier.object, modifier.grid_name, modifier.threshold = obj, grid, threshold
    modifier.resolution_mode = "GRID"
    made = target.evaluated_get(bpy.context.evaluated_depsgraph_get())
    vertices = np.array([made.matrix_world @ v.co for v in made.to_mesh().vertices])
    bpy.data.objects.remove(target)
    return vertices


def solid_volume(obj):
    mesh = bmesh.new()
    mesh.from_mesh(obj.data)
    volume = mesh.calc_volume(signed=True)
    mesh.free()
    return volume


def split_normals(obj):
    """Unit normal at each vertex as it is drawn, (n, 3), world space."""
    obj.data.calc_normals_split()
    normals = np.zeros((len(obj.data.vertices), 3))
    for loop in obj.data.loops:
        normals[loop.vertex_index] += loop.normal
    normals = normals @ np.array(obj.matrix_world)[:3, :3].T
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


class Checks:
    def __init__(self):
        self.lines = []

    def __call__(self, what, value, limit, unit):
        good = bool(value <= limit)
        self.lines.append({"what": what, "value": float(value), "limit": limit, "unit": unit, "ok": good})
        print(f"{'ok  ' if good else 'FAIL'} {what}: {value:.4g} {unit} (at most {limit:g})")


def check(ply, glb, volumes):
    checks = Checks()
    a, b = corners(ply), corners(glb)
    size = np.ptp(a, axis=0).max()
    checks("PLY and GLB: boxes differ", max(np.abs(a.min(0) - b.min(0)).max(), np.abs(a.max(0) - b.max(0)).max()) / size,
           MESH_TOLERANCE, "of the size")
    checks("PLY and GLB: vertices differ", np.abs(a - b).max() / size if a.shape == b.shape else np.inf, MESH_TOLERANCE,
           "of the size")
    volume = solid_volume(ply)
    checks("PLY: inside out", 0 if volume > 0 else 1, 0, "")
    checks("PLY and GLB: volumes differ", abs(solid_volume(glb) / volume - 1), 1e-4, "of the volume")

    # Blender's glTF importer uses the normals of the file. Its PLY importer ignores them, so that Blender computes the PLY's normals.
    flat = sum(not p.use_smooth for p in glb.data.polygons)  # flat if all three normals of a triangle are equal
    checks("GLB: flat triangles", flat / len(glb.data.polygons), 0.25, "of all")
    checks("GLB: normals of its own are missing", 0 if glb.data.has_custom_normals else 1, 0, "")
    for polygon in ply.data.polygons:
        polygon.use_smooth = True
    cosines = np.clip((split_normals(ply) * split_normals(glb)).sum(1), -1, 1)
    checks("normals: the file's and Blender's, 99 of 100 differ", np.degrees(np.arccos(np.percentile(cosines, 1))),
           NORMAL_TOLERANCE, "degrees")

    tree = BVHTree.FromPolygons([Vector(v) for v in a], [p.vertices[:] for p in ply.data.polygons])
    for obj in volumes:
        for grid in obj.data.grids:
            h = (obj.matrix_world @ grid.matrix_object).to_scale()[0]
            # A fog volume is 0 on the surface and 1 three voxels inside: its level set 0.01 lies close to the surface.
            made = volume_to_mesh(obj, grid.name, 0.0 if grid.name == "surface" else 0.01)
            what = f"{obj.name}:{grid.name}"
            if len(made) == 0:
                checks(f"{what}: has no surface", 1, 0, "")
                continue
            # Volume to Mesh takes values as those at the corners of voxels, OpenVDB as those at their centres: half a voxel is subtracted.
            made -= h / 2
            boxes = max(np.abs(made.min(0) - a.min(0)).max(), np.abs(made.max(0) - a.max(0)).max()) / h
            off = np.array([tree.find_nearest(Vector(v))[3] for v in made]) / h
            is_fog = grid.name != "surface"
            checks(f"{what}: box off the mesh's", boxes, 1 if is_fog else BOX_TOLERANCE, "voxels")
            checks(f"{what}: mean distance to the mesh", off.mean(), BOX_TOLERANCE if is_fog else MEAN_TOLERANCE, "voxels")
    return checks.lines


def cut(obj, at):
    """The part of a mesh with x <= at in the world, with smooth shading."""
    mesh = bmesh.new()
    mesh.from_mesh(obj.data)
    mesh.transform(obj.matrix_world)
    bmesh.ops.bisect_plane(mesh, geom=mesh.verts[:] + mesh.edges[:] + mesh.faces[:], plane_co=(at, 0, 0),
                           plane_no=(1, 0, 0), clear_outer=True)
    part = bpy.data.objects.new("half", bpy.data.meshes.new("half"))
    mesh.to_mesh(part.data)
    mesh.free()
    part.data.polygons.foreach_set("use_smooth", [True] * len(part.data.polygons))
    bpy.context.collection.objects.link(part)
    return part


def new_material(name, socket, kinds):
    """A material with nodes of these kinds, the last of which is connected to the output's `socket`."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    nodes = [tree.nodes.new(f"ShaderNode{kind}") for kind in kinds]
    tree.links.new(nodes[-1].outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs[socket])
    return material, tree.links, nodes


def surface_material(color):
    material, _, (shader,) = new_material("surface", "Surface", ["BsdfPrincipled"])
    shader.inputs["Base Color"].default_value = (*color, 1)
    shader.inputs["Roughness"].default_value = 0.42
    shader.inputs["Specular"].default_value = 0.35
    return material


def volume_material(color, low, high):
    """Emission that grows from `low` to `high` of the grid "density", the name that Blender's shaders use."""
    material, links, (values, scaled, shader) = new_material("volume", "Volume", ["Attribute", "MapRange", "Emission"])
    values.attribute_name = "density"
    scaled.inputs["From Min"].default_value, scaled.inputs["From Max"].default_value = low, high
    scaled.inputs["To Max"].default_value = GLOW
    shader.inputs["Color"].default_value = (*color, 1)
    links.new(values.outputs["Fac"], scaled.inputs["Value"])
    links.new(scaled.outputs["Result"], shader.inputs["Strength"])
    return material


def light(place, target, power, size):
    lamp = bpy.data.objects.new("light", bpy.data.lights.new("light", "AREA"))
    lamp.data.energy, lamp.data.size = power, size
    lamp.location = place
    lamp.rotation_euler = (Vector(target) - Vector(place)).to_track_quat("-Z", "Y").to_euler()
    bpy.context.collection.objects.link(lamp)


def render(path, size, ply, volume, low, high):
    """Half of the mesh around the volume: misalignment would be visible along the cut."""
    a = corners(ply)
    box_min, box_max = a.min(0), a.max(0)
    # The scene is scaled to two metres, so that lights, lens and clipping need not depend on the size and unit of the image.
    home = Matrix.Scale(2 / (box_max - box_min).max(), 4) @ Matrix.Translation(-(box_min + box_max) / 2)
    half = cut(ply, (box_min + box_max)[0] / 2)
    half.data.materials.append(surface_material((0.10, 0.36, 0.50)))
    half.matrix_world = home
    volume.matrix_world = home @ volume.matrix_world
    volume.data.render.space = "WORLD"  # emission per metre of the scaled scene, not per micrometre of the object
    volume.data.materials.append(volume_material((1.0, 0.42, 0.12), low, high))

    world = bpy.data.worlds.new("world")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs[0].default_value = (0.012, 0.014, 0.018, 1)
    light((-2.5, -3.5, 3.0), (0, 0, 0), 260, 1.5)
    light((-3.5, 2.0, 1.0), (0, 0, 0), 120, 1.0)
    light((3.0, -2.0, -2.0), (0, 0, 0), 30, 2.0)
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    bpy.context.collection.objects.link(camera)
    camera.data.lens = 80
    camera.location = (1.1, -4.9, 2.3)
    camera.rotation_euler = (-camera.location).to_track_quat("-Z", "Y").to_euler()
    scene = bpy.context.scene
    scene.camera, scene.world = camera, world
    scene.render.engine = "CYCLES"
    scene.cycles.device, scene.cycles.samples, scene.cycles.seed = "CPU", SAMPLES, 1
    scene.cycles.use_denoising = False  # Debian's Blender has no denoiser
    scene.cycles.max_bounces = 2
    scene.cycles.volume_step_rate = 2  # step length in voxels; short enough for emission that varies smoothly
    scene.view_settings.view_transform = "Standard"
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)


def main():
    words = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else []
    given = dict(word.split("=", 1) for word in words[1:] if "=" in word)
    out = pathlib.Path(words[0] if words else ".").resolve()
    files = [pathlib.Path(word).resolve() for word in words[1:] if "=" not in word and word != "checks"]
    wanted = {end: [f for f in files if f.suffix == end] for end in (".vdb", ".ply", ".glb")}
    missing = [end for end, found in wanted.items() if not found] + [str(f) for f in files if not f.is_file()]
    if missing:
        print(f"13_blender.py: expected OUTDIR FILE.vdb... FILE.ply FILE.glb, missing: {', '.join(missing)}",
              file=sys.stderr)
        return 2
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    volumes = [import_volume(path) for path in wanted[".vdb"]]
    ply, glb = import_mesh(wanted[".ply"][0]), import_mesh(wanted[".glb"][0])
    lines = check(ply, glb, volumes)
    (out / "blender.json").write_text(json.dumps({"blender": bpy.app.version_string, "checks": lines}, indent=2) + "\n")

    good = all(line["ok"] for line in lines)
    if "checks" in words:
        return 0 if good else 1
    shown, low, high = next((v for v in volumes if "density" in [g.name for g in v.data.grids]), None), 0, 1
    if "image" in given:
        path, low, high = given["image"].rsplit(":", 2)
        shown = import_volume(pathlib.Path(path).resolve())
    if shown is None:
        print("no grid 'density': Blender draws no level set, and no picture is made", file=sys.stderr)
        return 1
    for obj in [ply, glb, *volumes]:
        obj.hide_render = obj is not shown
    size = [int(n) for n in given["size"].split("x")] if "size" in given else PICTURE
    render(out / "blender.png", size, ply, shown, float(low), float(high))
    bpy.context.preferences.filepaths.save_version = 0  # Blender then keeps no backup of an older file with this name
    bpy.ops.wm.save_as_mainfile(filepath=str(out / "blender.blend"), compress=True)
    return 0 if good else 1


if __name__ == "__main__":
    try:
        code = main()
    except Exception as error:  # Blender's exit code is 0 even if its script fails
        print(f"13_blender.py: {error}", file=sys.stderr)
        code = 1
    sys.exit(code)
