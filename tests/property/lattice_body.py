"""A body that reveals its position, size and orientation: a rotated ellipsoid with three different axes, in voxels of a lattice."""
import numpy as np
import pyopenvdb

SIZE = np.array([14, 12, 10])
RADII, CENTRE = np.array([4.4, 3.3, 2.6]), np.array([6.3, 5.6, 4.4])


def rotation(rng):
    """A uniform random rotation, from a unit quaternion."""
    w, x, y, z = (q := rng.normal(size=4)) / np.linalg.norm(q)
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


AXES = rotation(np.random.default_rng(5))  # of the body, in voxels


def level(index):
    """Approximate distance to the body, in voxels: negative inside."""
    q = (np.asarray(index) - CENTRE) @ AXES / RADII
    r = np.linalg.norm(q, axis=-1)
    return (r - 1) * r / np.maximum(np.linalg.norm(q / RADII, axis=-1), 1e-9)


def indices():
    """[z, y, x, 3]"""
    return np.stack(np.meshgrid(*map(np.arange, SIZE), indexing="ij"), -1).transpose(2, 1, 0, 3)


def image():
    """[z, y, x]: the body, on a ramp so that neighbouring voxels differ."""
    return (np.where(level(indices()) < 0, 150, 10) + indices() @ (1, 2, 3)).astype(np.uint8)


def mesh_of_body():
    """An icosahedron's faces, subdivided 4 times and projected onto the body; in voxels."""
    golden = (1 + 5 ** 0.5) / 2
    vertices = [np.roll((0, a, b * golden), n) for n in range(3) for a in (-1, 1) for b in (-1, 1)]
    vertices = [v / np.linalg.norm(v) for v in vertices]
    near = 1.2
    faces = [(a, b, c) for a in range(12) for b in range(a) for c in range(b)
             if max(np.linalg.norm(vertices[p] - vertices[q]) for p, q in ((a, b), (b, c), (c, a))) < near]
    for _ in range(4):
        middle, cut = {}, []
        for face in faces:
            for p, q in zip(face, face[1:] + face[:1]):
                if (min(p, q), max(p, q)) not in middle:
                    middle[min(p, q), max(p, q)] = len(vertices)
                    between = vertices[p] + vertices[q]
                    vertices.append(between / np.linalg.norm(between))
            m = [middle[min(p, q), max(p, q)] for p, q in zip(face, face[1:] + face[:1])]
            cut += [(face[0], m[0], m[2]), (face[1], m[1], m[0]), (face[2], m[2], m[1]), tuple(m)]
        faces = cut
    return np.array(vertices) * RADII @ AXES.T + CENTRE, np.array(faces, np.uint32)


MESH = mesh_of_body()
VOXELS_OF_BODY = 0.7  # voxel size of the level set, relative to the lattice's smallest spacing


def write_body(path, lattice):
    """The body as a level set in the world of a lattice, relative to a round position near it: its vertices have single precision."""
    vertices, faces = MESH
    h = VOXELS_OF_BODY * np.linalg.svd(lattice.steps, compute_uv=False)[-1]
    near = np.round(lattice.world(CENTRE) / h)
    transform = pyopenvdb.createLinearTransform(h)
    grid = pyopenvdb.FloatGrid.createLevelSetFromPolygons(
        points=(lattice.world(vertices) - near * h).astype(np.float32), triangles=outward(vertices, faces),
        transform=transform, halfWidth=3)
    moved = np.diag([h, h, h, 1.0])
    moved[3, :3] = near * h
    grid.transform = pyopenvdb.createLinearTransform(moved.tolist())
    grid.name = "surface"
    pyopenvdb.write(str(path), grids=[grid])


def outward(vertices, faces):
    a, b, c = (vertices[faces[:, n]] for n in range(3))
    turned = np.einsum("ni,ni->n", np.cross(b - a, c - a), a - CENTRE) < 0
    return np.where(turned[:, None], faces[:, ::-1], faces)
