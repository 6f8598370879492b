"""Bodies with a closed form: points on them, signed distance to them, their volume within a box. World units, negative inside."""
import dataclasses

import numpy as np
import tifffile


@dataclasses.dataclass
class Ellipsoid:
    radii: tuple
    centre: np.ndarray

    @property
    def volume(self):
        return 4 / 3 * np.pi * np.prod(self.radii)

    @property
    def extent(self):
        return np.array(self.radii, float)

    def many_points(self, count, rng):
        """Uniform by area: points of the sphere, accepted according to how much the map to the ellipsoid stretches the area there."""
        unit = rng.normal(size=(8 * count, 3))
        unit /= np.linalg.norm(unit, axis=1, keepdims=True)
        stretch = np.linalg.norm(unit / self.radii, axis=1)
        return self.centre + (unit * self.radii)[rng.random(len(unit)) < stretch / stretch.max()][:count]

    def distance(self, positions):
        """The exact signed distance: the root of Eberly's equation by bisection."""
        r = self.extent
        p = np.abs(positions - self.centre)
        low, high = np.full(len(p), -r.min() ** 2), np.linalg.norm(p * r, axis=1)
        low += 1e-12 * r.min() ** 2
        for _ in range(80):
            t = (low + high) / 2
            outside = ((r * p / (t[:, None] + r**2)) ** 2).sum(1) > 1
            low, high = np.where(outside, t, low), np.where(outside, high, t)
        nearest = r**2 * p / (low[:, None] + r**2)
        return np.sign(((p / r) ** 2).sum(1) - 1) * np.linalg.norm(p - nearest, axis=1)

    def inside(self, positions):
        return (((positions - self.centre) / self.radii) ** 2).sum(-1) < 1

    def volume_in(self, low, high, fine=2000):
        """The volume within a box: exact along x, by midpoints in y and z."""
        low, high = (np.clip((np.asarray(v, float) - self.centre) / self.radii, -1, 1) for v in (low, high))
        steps = (high - low) / fine
        y, z = (low[a] + steps[a] * (np.arange(fine) + 0.5) for a in (1, 2))
        half = np.sqrt(np.maximum(0, 1 - y**2 - z[:, None] ** 2))
        chords = np.maximum(0, np.minimum(high[0], half) - np.maximum(low[0], -half))
        return float(np.prod(self.radii) * chords.sum() * steps[1] * steps[2])


@dataclasses.dataclass
class Torus:
    """Around the z axis."""
    ring: float
    tube: float
    centre: np.ndarray

    @property
    def volume(self):
        return 2 * np.pi**2 * self.ring * self.tube**2

    @property
    def extent(self):
        return np.array([self.ring + self.tube, self.ring + self.tube, self.tube])

    def many_points(self, count, rng):
        around, across = rng.uniform(0, 2 * np.pi, (2, 4 * count))
        away = self.ring + self.tube * np.cos(across)
        keep = np.flatnonzero(rng.random(len(away)) * (self.ring + self.tube) < away)[:count]
        x = np.stack([away * np.cos(around), away * np.sin(around), self.tube * np.sin(across)], 1)
        return self.centre + x[keep]

    def distance(self, positions):
        p = positions - self.centre
        return np.hypot(np.hypot(p[:, 0], p[:, 1]) - self.ring, p[:, 2]) - self.tube


def sphere(radius, centre):
    return Ellipsoid((radius,) * 3, centre)


def even_points(body, count, rng, fill=12):
    """Exact points that are well spread: each is the one farthest from those before among `fill` times as many random points."""
    many = body.many_points(fill * count, rng)
    chosen = np.empty(count, int)
    chosen[0] = 0
    room = np.full(len(many), np.inf)
    for n in range(1, count):
        room = np.minimum(room, ((many - many[chosen[n - 1]]) ** 2).sum(1))
        chosen[n] = room.argmax()
    return many[chosen]


# ---- files -------------------------------------------------------------------------------------------------------

def write_image(path, values, spacing):
    """Writes an array z y x as Fiji does."""
    tifffile.imwrite(path, values, imagej=True, resolution=(1 / spacing[0], 1 / spacing[1]),
                     metadata={"spacing": float(spacing[2]), "unit": "um", "axes": "ZYX"})


def read_mesh(path):
    """Vertices and triangles of a binary little-endian PLY with float properties of vertices, x y z first, and uchar-int lists."""
    data = path.read_bytes()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    head = data[:end].decode()
    count = int(head.split("element vertex ")[1].split()[0])
    properties = head.split("element vertex")[1].split("element face")[0].count("property float")
    vertices = np.frombuffer(data, "<f4", count * properties, end).reshape(count, properties)[:, :3].astype(float)
    face = np.dtype([("n", "u1"), ("v", "<i4", 3)])
    faces = np.frombuffer(data, face, int(head.split("element face ")[1].split()[0]), end + 4 * count * properties)
    return vertices, faces["v"]


def areas(vertices, triangles):
    corners = vertices[triangles]
    return 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)


def enclosed(vertices, triangles):
    a, b, c = np.moveaxis(vertices[triangles] - vertices.mean(0), 1, 0)
    return float((a * np.cross(b, c)).sum() / 6)
