"""A plugin of napari that segments with covol."""
