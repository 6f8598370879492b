"""Common to the tests of the module covol."""
import os
import pathlib

import pytest

import covol


@pytest.fixture(scope="session")
def program():
    """The command-line program that was built with the module."""
    return str(pathlib.Path(os.environ["COVOL"]).resolve())


@pytest.fixture(scope="session")
def sphere():
    """(Image, points, labels) of a sphere of radius 0.8, 40^3 voxels."""
    return covol.phantom("sphere", 40, 120)


@pytest.fixture(scope="session")
def solved(sphere):
    """Its segmentation."""
    image, points, _ = sphere
    return covol.segment(image, points)


def dice(a, b):
    return 2 * ((a > 0) & (b > 0)).sum() / ((a > 0).sum() + (b > 0).sum())
