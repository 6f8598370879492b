"""Runs inside a Blender with a window: the add-on's result, as a user sees it after Find the surface.

    blender --factory-startup --enable-event-simulate --python tests/pictures/blender_window.py -- ADDON.zip IMAGE MARKS.xyz FOLDER

Writes FOLDER/screen.png. The script sets what a user would click.
"""
import pathlib
import sys

import bpy
import numpy as np
from mathutils import Matrix

archive, image, points, folder = (pathlib.Path(word) for word in sys.argv[sys.argv.index("--") + 1:])
STEP = 0.5  # seconds between two actions, in which Blender draws the window


def find():
    bpy.ops.preferences.addon_install(filepath=str(archive))
    bpy.ops.preferences.addon_enable(module="covol_blender")
    for each in list(bpy.data.objects):
        bpy.data.objects.remove(each)
    settings = bpy.context.scene.covol
    settings.image, settings.folder, settings.voxel_size = str(image), str(folder), "3"
    holder = bpy.data.objects.new("marks", None)
    bpy.context.scene.collection.objects.link(holder)
    settings.marks = holder
    for place in np.loadtxt(points):
        mark = bpy.data.objects.new("mark", None)
        bpy.context.scene.collection.objects.link(mark)
        mark.empty_display_type, mark.empty_display_size = "SPHERE", 0.03
        mark.parent, mark.matrix_world = holder, Matrix.Translation(settings.scale * place)
    bpy.context.view_layer.update()
    bpy.ops.covol.segment()
    surface = next(child for child in settings.space.children if child["covol_role"] == "surface")
    surface.data.materials.append(bpy.data.materials.new("surface"))
    surface.data.materials[0].diffuse_color = (0.16, 0.36, 0.62, 1)
    bpy.ops.object.select_all(action="DESELECT")
    bpy.context.view_layer.objects.active = surface
    surface.select_set(True)


def view():
    window = bpy.context.window_manager.windows[0]
    area = next(each for each in window.screen.areas if each.type == "VIEW_3D")
    return window, area, {region.type: region for region in area.regions}


def frame():
    window, area, regions = view()
    space = area.spaces.active
    space.show_region_ui, space.overlay.show_relationship_lines, space.overlay.show_extras = True, False, True
    with bpy.context.temp_override(window=window, area=area, region=regions["WINDOW"]):
        bpy.ops.view3d.view_selected(use_all_regions=False)
        bpy.ops.view3d.zoom(delta=2)


def choose_tab():
    """The add-on's tab is the last of Item, Tool, View, covol."""
    window, area, _ = view()
    x, y = area.x + area.width - 12, area.y + area.height - 215
    for kind, value in (("MOUSEMOVE", "NOTHING"), ("LEFTMOUSE", "PRESS"), ("LEFTMOUSE", "RELEASE")):
        window.event_simulate(type=kind, value=value, x=x, y=y)


def save():
    bpy.ops.screen.screenshot(filepath=str(folder / "screen.png"))
    bpy.ops.wm.quit_blender()


steps = [find, frame, choose_tab, lambda: None, save]


def go_on():
    steps.pop(0)()
    return STEP if steps else None


bpy.context.preferences.view.show_splash = False
bpy.app.timers.register(go_on, first_interval=STEP)
