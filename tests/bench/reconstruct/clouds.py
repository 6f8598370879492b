"""Point clouds drawn from truth meshes: uniform by area, with noise and outliers."""
import numpy as np


def sample_with_normals(vertices, triangles, count, random):
    """Points on the triangles, uniform by area, and the unit normals there."""
    corners = vertices[triangles]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(across, axis=1)
    drawn = random.choice(len(triangles), count, p=areas / areas.sum())
    a, b, c = np.moveaxis(corners[drawn], 1, 0)
    root, fraction = np.sqrt(random.random((count, 1))), random.random((count, 1))
    return a * (1 - root) + b * root * (1 - fraction) + c * root * fraction, across[drawn] / areas[drawn, None]


def sample(vertices, triangles, count, random):
    """Points on the triangles, uniform by area."""
    return sample_with_normals(vertices, triangles, count, random)[0]


def cloud(mesh, count, noise=0, outliers=0, seed=1):
    """(n x 3) points; for one seed the positions are the same with all values of noise and outliers.

    @param mesh      (vertices, triangles)
    @param noise     standard deviation along each axis, in % of the mesh's bounding box diagonal
    @param outliers in % of count, in addition to it; uniform in a box 10 % longer than the mesh's bounding box
    """
    vertices, triangles = mesh
    places, errors, strays = (np.random.default_rng([seed, stream]) for stream in range(3))
    low, high = vertices.min(0), vertices.max(0)
    points = sample(vertices, triangles, count, places)
    points += errors.normal(size=points.shape) * np.linalg.norm(high - low) * noise / 100
    wide = 1.1 * (strays.random((round(count * outliers / 100), 3)) - 0.5)
    return np.concatenate([points, (low + high) / 2 + wide * (high - low)])
