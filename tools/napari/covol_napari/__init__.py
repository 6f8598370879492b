"""A napari plugin for segmentation with covol."""
