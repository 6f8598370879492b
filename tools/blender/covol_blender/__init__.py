"""covol in Blender: computes a surface from marks on the border of a structure, as a mesh and a volume, which keep their place in
the scene when they are recomputed. In the sidebar of the 3D view, tab covol."""
import os

import bpy
import numpy as np
from bpy.app.handlers import persistent
from mathutils import Matrix, Vector

from . import _process, job

bl_info = {
    "name": "covol",
    "author": "covol developers",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "3D view > Sidebar > covol",
    "description": "Surfaces in 3D images and of point clouds from a few marks",
    "category": "Import-Export",
}
# Custom properties of objects:
ROLE = "covol_role"      # of an object below the space: the result that it shows, "surface" or "volume"
MESHES = "covol_meshes"  # of the surface: names of its meshes, one per line, one for each frame of a time-lapse
START = "covol_start"    # of the surface: the frame of Blender in which the first mesh of MESHES is shown
FIGURES = ("volume", "area", "genus")
TICK = 0.1           # seconds between two checks whether the running program has sent events


def is_marks(_, candidate):
    return candidate.type in ("EMPTY", "MESH")


class Preferences(bpy.types.AddonPreferences):
    bl_idname = __package__
    program: bpy.props.StringProperty(name="Program", subtype="FILE_PATH",
                                      description="Path of the program covol; if empty, the variable COVOL or the search path is used")

    def draw(self, _):
        self.layout.prop(self, "program")


class Settings(bpy.types.PropertyGroup):
    image: bpy.props.StringProperty(name="Image", subtype="FILE_PATH",
                                    description="3D image, of any format that covol reads; empty: the marks are a point cloud")
    marks: bpy.props.PointerProperty(name="Marks", type=bpy.types.Object, poll=is_marks,
                                     description="An empty whose children are the marks, or a mesh whose vertices are the marks")
    space: bpy.props.PointerProperty(name="Space", type=bpy.types.Object,
                                     description="The object whose coordinate system is that of the image, in the image's unit and with its "
                                     "origin; results follow when it is moved, scaled or rotated. It is created if there is none")
    scale: bpy.props.FloatProperty(name="Scale", default=0.01, min=1e-9, soft_max=1000,
                                   description="Blender's units for one unit of the image, for a space that is created")
    is_lapse: bpy.props.BoolProperty(name="Time-lapse", description="All frames of the image, from Blender's current frame on; the marks belong to "
                                     "the first one")
    voxel_size: bpy.props.StringProperty(name="Voxel size", description="In the image's unit, or voxels as in 2vx; empty: automatic")
    options: bpy.props.StringProperty(name="Options", description="Further options of covol segment, --model paper for example")
    folder: bpy.props.StringProperty(name="Folder", subtype="DIR_PATH", default="//covol",
                                     description="Where results are written; // is the folder of the .blend file")
    status: bpy.props.StringProperty()


def program_of(context):
    addon = context.preferences.addons.get(__package__)
    return addon.preferences.program if addon else ""


def space_of(context):
    """The object that defines the coordinate system of the image; created if there is none."""
    settings = context.scene.covol
    if settings.space is None:
        space = bpy.data.objects.new("covol space", None)
        context.scene.collection.objects.link(space)
        space.scale = (settings.scale,) * 3
        context.view_layer.update()
        settings.space = space
    return settings.space


def places_of(marks, space):
    """(n, 3), x, y, z, positions of the marks in the image's world."""
    if marks is None:
        return np.zeros((0, 3))
    if marks.type == "MESH":
        local = np.empty(3 * len(marks.data.vertices))
        marks.data.vertices.foreach_get("co", local)
        turn = np.array(marks.matrix_world)
        places = local.reshape(-1, 3) @ turn[:3, :3].T + turn[:3, 3]
    else:
        places = np.array([child.matrix_world.translation for child in marks.children]).reshape(-1, 3)
    back = np.linalg.inv(np.array(space.matrix_world))
    return places @ back[:3, :3].T + back[:3, 3]


def child_of(space, role, make, context):
    """The object below the space that has this role; created if there is none."""
    for child in space.children:
        if child.get(ROLE) == role:
            return child
    made = bpy.data.objects.new(f"covol {role}", make())
    made[ROLE] = role
    context.scene.collection.objects.link(made)
    made.parent = space
    made.matrix_parent_inverse = Matrix()
    return made


def fill(mesh, vertices, faces):
    mesh.clear_geometry()
    mesh.from_pydata(vertices.tolist(), [], faces.tolist())
    mesh.polygons.foreach_set("use_smooth", np.ones(len(faces), bool))
    mesh.update()


def meshes_of(surface, count):
    """The surface's meshes, one for each frame: reuses those of the last result, copies the visible one's materials, removes others."""
    shown = surface.data
    kept = [mesh for mesh in (bpy.data.meshes.get(name) for name in surface.get(MESHES, "").splitlines()) if mesh is not None] or [shown]
    made = kept[:count] + [shown.copy() for _ in range(count - len(kept))]
    for mesh in made:
        mesh.use_fake_user = count > 1  # Blender then also saves the meshes of frames that are not visible
        if mesh is not shown:
            mesh.materials.clear()
            for material in shown.materials:
                mesh.materials.append(material)
    surface.data = made[0]
    for mesh in kept[count:]:
        bpy.data.meshes.remove(mesh)
    surface[MESHES] = "\n".join(mesh.name for mesh in made)
    return made


@persistent
def show_frame(scene, _=None):
    """Shows the surfaces of time-lapses at the scene's frame; outside of the time-lapse, those of its first or last frame."""
    for surface in scene.objects:
        names = surface.get(MESHES, "").splitlines()
        if len(names) > 1:
            n = min(max(scene.frame_current - surface[START], 0), len(names) - 1)
            mesh = bpy.data.meshes.get(names[n])
            if mesh is not None and surface.data != mesh:
                surface.data = mesh
                for key in FIGURES:
                    surface[f"covol_{key}"] = mesh[f"covol_{key}"]


def show(context, space, run, found):
    """Adds the results of a run to the scene: to the objects of the last run, which keep their materials and modifiers."""
    start = context.scene.frame_current
    surface = child_of(space, "surface", lambda: bpy.data.meshes.new("covol surface"), context)
    known = next(each for each in found if each is not None)
    for mesh, each in zip(meshes_of(surface, len(found)), found):
        # A frame that failed gets the mesh of the last successful frame before it, or else of the first one after it.
        known = each or known
        fill(mesh, *known[:2])
        for key in FIGURES:
            mesh[f"covol_{key}"] = surface[f"covol_{key}"] = known[2]["surface"][key]
    surface[START] = start
    volume = child_of(space, "volume", lambda: bpy.data.volumes.new("covol volume"), context)
    before = volume.get("covol_files", "").splitlines()
    data, first = volume.data, run.at(run.vdb, next(n for n, each in enumerate(found) if each is not None))
    data.filepath, data.is_sequence = str(first), run.is_lapse
    if run.is_lapse:  # the files are numbered from 0, but Blender numbers the frames of a sequence from 1
        data.frame_start, data.frame_duration, data.frame_offset, data.sequence_mode = start, len(found), -1, "EXTEND"
    if not data.grids.load():
        raise _process.Failed(4, f"{first}: {data.grids.error_message}")
    volume["covol_files"] = "\n".join(map(str, run.files()))
    for path in before:  # files of the previous result, to which no object refers any more
        if os.path.exists(path):
            os.remove(path)
    show_frame(context.scene)
    context.scene.covol.status = job.summary(found)


class Segment(bpy.types.Operator):
    """Computes the surface through the marks, with the image or from the marks alone"""
    bl_idname = "covol.segment"
    bl_label = "Find the surface"
    bl_options = {"REGISTER"}

    _timer = _run = _space = None

    @classmethod
    def poll(cls, context):
        return context.scene.covol.marks is not None

    def start(self, context):
        settings = context.scene.covol
        folder = bpy.path.abspath(settings.folder)
        if settings.folder.startswith("//") and not bpy.data.filepath:
            raise _process.Failed(3, "save the .blend file first, or choose a folder that does not begin with //")
        self._space = space_of(context)
        image = bpy.path.abspath(settings.image) if settings.image else ""
        name = os.path.basename(image).split(".")[0] if image else settings.marks.name
        self._run = job.Job(program_of(context), folder, name, image, places_of(settings.marks, self._space), settings.voxel_size,
                            settings.options, settings.is_lapse)

    def show_event(self, event):
        kind, value = event
        if kind == "warning":
            self.report({"WARNING"}, value)
        elif kind == "stage":
            bpy.context.scene.covol.status = f"{value[0]} {100 * value[1]:.0f} %"

    def finish(self, context):
        show(context, self._space, self._run, self._run.result())
        self.report({"INFO"}, context.scene.covol.status)
        return {"FINISHED"}

    def fail(self, context, error):
        context.scene.covol.status = str(error)
        self.report({"ERROR"}, str(error))
        return {"CANCELLED"}

    def execute(self, context):
        """Runs to the end, for scripts."""
        try:
            self.start(context)
            for event in self._run.process.follow():
                self.show_event(event)
            return self.finish(context)
        except _process.Failed as error:
            return self.fail(context, error)

    def invoke(self, context, _):
        """Runs in the background; Escape cancels."""
        try:
            self.start(context)
        except _process.Failed as error:
            return self.fail(context, error)
        self._timer = context.window_manager.event_timer_add(TICK, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type == "ESC":
            self._run.process.cancel()
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        events = self._run.process.poll()
        for found in events or []:
            self.show_event(found)
        for area in context.screen.areas:
            area.tag_redraw()
        if events is not None:
            return {"PASS_THROUGH"}
        context.window_manager.event_timer_remove(self._timer)
        try:
            return self.finish(context)
        except _process.Failed as error:
            return self.fail(context, error)


class AddMark(bpy.types.Operator):
    """Adds a mark at the 3D cursor, below the empty that contains the marks"""
    bl_idname = "covol.add_mark"
    bl_label = "Mark at the cursor"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        marks = context.scene.covol.marks
        return marks is None or marks.type == "EMPTY"

    def execute(self, context):
        settings = context.scene.covol
        if settings.marks is None:
            settings.marks = bpy.data.objects.new("covol marks", None)
            context.scene.collection.objects.link(settings.marks)
        mark = bpy.data.objects.new("mark", None)
        context.scene.collection.objects.link(mark)
        mark.empty_display_size = 3 * (settings.space.matrix_world.median_scale if settings.space else settings.scale)
        mark.empty_display_type = "SPHERE"
        mark.parent = settings.marks
        mark.matrix_world = Matrix.Translation(Vector(context.scene.cursor.location))
        return {"FINISHED"}


class Panel(bpy.types.Panel):
    bl_idname = "VIEW3D_PT_covol"
    bl_label = "covol"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "covol"

    def draw(self, context):
        settings, layout = context.scene.covol, self.layout
        layout.use_property_split = True
        for name in ("image", "marks", "space", "scale", "is_lapse", "voxel_size", "options", "folder"):
            row = layout.row()
            row.enabled = name != "scale" or settings.space is None
            row.prop(settings, name)
        layout.operator(AddMark.bl_idname)
        layout.operator(Segment.bl_idname)
        if settings.status:
            layout.label(text=settings.status)


CLASSES = (Preferences, Settings, Segment, AddMark, Panel)


def register():
    for each in CLASSES:
        bpy.utils.register_class(each)
    bpy.types.Scene.covol = bpy.props.PointerProperty(type=Settings)
    bpy.app.handlers.frame_change_pre.append(show_frame)


def unregister():
    bpy.app.handlers.frame_change_pre.remove(show_frame)
    del bpy.types.Scene.covol
    for each in reversed(CLASSES):
        bpy.utils.unregister_class(each)
