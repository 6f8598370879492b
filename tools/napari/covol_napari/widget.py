"""The plugin's panel. Its functions are in layers.py; only this file needs napari, magicgui and Qt."""


def make_widget():
    """Choose an image and marks on it, and segment; results come as layers."""
    from magicgui import magicgui
    from napari import current_viewer
    from napari.layers import Image, Labels, Points, Shapes
    from napari.qt.threading import thread_worker
    from napari.utils.notifications import show_error, show_warning

    import covol

    from . import layers

    @magicgui(call_button="Segment", layout="vertical", model={"choices": ["guided", "paper"]},
              labels_as={"choices": ["painted", "guess", "init"]},
              suggestions={"min": 0, "max": 20})
    def panel(image: Image, points: Points = None, shapes: Shapes = None, labels: Labels = None, labels_as: str = "painted",
              model: str = "guided", voxel_size: str = "", suggestions: int = 3) -> None:
        viewer = current_viewer()
        step = tuple(viewer.dims.current_step)[: max(0, viewer.dims.ndim - 3)]
        options = {"model": model}
        if voxel_size.strip():
            text = voxel_size.strip()
            options["voxel_size"] = text if text.endswith("vx") else float(text)

        @thread_worker
        def run():
            return layers.segment(image, points, shapes, labels, labels_as, suggestions, step, **options)

        def show(made):
            panel.call_button.enabled = True
            layers.show(viewer, made)
            for line in made[0][1]["metadata"]["covol"]["warnings"]:
                show_warning(line)

        def fail(error):
            panel.call_button.enabled = True
            show_error(str(error) if isinstance(error, covol.Error) else repr(error))

        worker = run()
        worker.returned.connect(show)
        worker.errored.connect(fail)
        panel.call_button.enabled = False
        worker.start()

    return panel
