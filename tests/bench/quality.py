"""The error of a mesh of the sphere with six holes, in voxels of the image.

Between the holes the truth is the shell's outer edge, in the holes the sphere of the points. Vertices close to the rims, where
neither applies, are left out. Geometry: lib/src/analysis/phantom.cpp.
"""
import numpy as np

RADIUS = np.sqrt(3) / 2
THICKNESS = 0.04
MARGIN = 0.05  # width of the zone around a hole's rim in which vertices are left out, in world units
HOLES = {
    "sphere-round": lambda a, b, grow: np.hypot(a, b) < 0.30 + grow,
    "sphere-square": lambda a, b, grow: np.maximum(abs(a), abs(b)) < 0.25 + grow,
    "sphere-slit": lambda a, b, grow: (abs(a) < 0.308 + grow) & (abs(b) < 0.11 + grow),
}


def read_vertices(path):
    """The vertices of a binary little-endian PLY whose vertex properties are all floats, x, y, z first."""
    data = path.read_bytes()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    header = data[:end].decode()
    count = int(header.split("element vertex ")[1].split()[0])
    properties = header.split("element vertex")[1].split("element face")[0].count("property float")
    values = np.frombuffer(data, "<f4", count * properties, end)
    return values.reshape(count, properties)[:, :3].astype(float)


def shell_errors(path, kind, voxel, octant=False):
    """Mean absolute error (between the holes, in the holes), voxels. octant: leave out the cut faces x, y, z = 0."""
    vertices = read_vertices(path)
    if octant:
        vertices = vertices[vertices.min(1) > 3 * voxel]
    radius = np.linalg.norm(vertices, axis=1)
    axis = np.abs(vertices).argmax(1)
    rows = np.arange(len(vertices))
    a, b = vertices[rows, (axis + 1) % 3], vertices[rows, (axis + 2) % 3]
    shell = ~HOLES[kind](a, b, MARGIN)
    hole = HOLES[kind](a, b, -MARGIN)
    mean = lambda off: float(np.abs(off).mean() / voxel) if len(off) else float("nan")
    return mean(radius[shell] - (RADIUS + THICKNESS / 2)), mean(radius[hole] - RADIUS)
