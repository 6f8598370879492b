"""covol reconstruct on clouds other than sampled smooth solids: rooms, fronts of houses, terrain, leaves, vehicle lidar, bodies
with edges.

  /usr/bin/python3 tests/bench/reconstruct/scenes.py --covol BINARY [--only NAME,NAME] [--results FOLDER] [--noise SPACINGS] [--clouds FOLDER]

Each scene is composed of flat and curved faces, so that its true surface is known. Scenes with `normals` include those of their
faces. For each result: the mean distance from its surface to the true one and back, in spacings; the fraction of its area that is
farther from all points than three times their spacing; for bodies with edges also the mean distance of the true edges to the
surface; triangles, genus, pieces, CPU seconds and MiB. Writes scenes.csv.
"""
import argparse
import csv
import json
import os
import pathlib
import subprocess
import tempfile

import numpy as np
from scipy.spatial import cKDTree

import clouds
import ply

HERE = pathlib.Path(__file__).resolve().parent


class Scene:
    """Faces from which points are drawn, uniform by area."""

    def __init__(self, seed=1):
        self.random = np.random.default_rng(seed)
        self.faces = []  # (area, function that draws n points: n -> positions, normals)
        self.edges = []  # sharp edges: pairs of end points, or arrays of points

    def rectangle(self, corner, u, v, flip=False, holes=()):
        """@param holes  (u0, u1, v0, v1) in fractions of the sides"""
        corner, u, v = (np.asarray(x, float) for x in (corner, u, v))
        normal = np.cross(u, v)
        area = np.linalg.norm(normal)
        normal *= (-1 if flip else 1) / area

        def draw(n):
            s = self.random.random((n, 2))
            for u0, u1, v0, v1 in holes:
                s = s[~((s[:, 0] > u0) & (s[:, 0] < u1) & (s[:, 1] > v0) & (s[:, 1] < v1))]
            return corner + s[:, :1] * u + s[:, 1:] * v, np.tile(normal, (len(s), 1))

        self.faces.append((area, draw))

    def box(self, low, high, inward=False, without=()):
        """@param without  faces to leave out, some of "x0 x1 y0 y1 z0 z1" by name"""
        low, high = np.asarray(low, float), np.asarray(high, float)
        for a in range(3):
            b, c = (a + 1) % 3, (a + 2) % 3
            u, v = np.zeros(3), np.zeros(3)
            u[b], v[c] = (high - low)[b], (high - low)[c]
            for end in (0, 1):
                if f"{'xyz'[a]}{end}" in without:
                    continue
                corner = low.copy()
                corner[a] = (low, high)[end][a]
                self.rectangle(corner, u, v, flip=(end == 0) != inward)
            for y in (low[b], high[b]):
                for z in (low[c], high[c]):
                    ends = np.empty((2, 3))
                    ends[0, a], ends[1, a] = low[a], high[a]
                    ends[:, b], ends[:, c] = y, z
                    self.edges.append(ends)

    def surface(self, area, draw):
        self.faces.append((area, draw))

    def points(self, count):
        areas = np.array([face[0] for face in self.faces])
        drawn = [draw(int(round(count * area / areas.sum()))) for area, (_, draw) in zip(areas, self.faces)]
        return np.concatenate([d[0] for d in drawn]), np.concatenate([d[1] for d in drawn])

    def edge_points(self, apart):
        found = [np.linspace(e[0], e[1], max(2, int(np.linalg.norm(e[1] - e[0]) / apart))) if len(e) == 2 else e for e in self.edges]
        return np.concatenate(found) if found else np.empty((0, 3))


def cylinder_side(scene, center, radius, height):
    def draw(n):
        t, z = scene.random.random(n) * 2 * np.pi, scene.random.random(n) * height
        out = np.stack([np.cos(t), np.sin(t), 0 * t], 1)
        return np.asarray(center) + radius * out + np.stack([0 * z, 0 * z, z], 1), out

    scene.surface(2 * np.pi * radius * height, draw)


def disc(scene, center, radius, up, inner=0.0):
    def draw(n):
        t, r = scene.random.random(n) * 2 * np.pi, np.sqrt(inner ** 2 + scene.random.random(n) * (radius ** 2 - inner ** 2))
        p = np.stack([r * np.cos(t), r * np.sin(t), 0 * t], 1)
        return np.asarray(center) + p, np.tile([0.0, 0.0, 1.0 if up else -1.0], (n, 1))

    scene.surface(np.pi * (radius ** 2 - inner ** 2), draw)


def circle(center, radius):
    t = np.linspace(0, 2 * np.pi, 400)
    return np.asarray(center) + radius * np.stack([np.cos(t), np.sin(t), 0 * t], 1)


def box(scene):
    scene.box((0, 0, 0), (14, 14, 10))


def cylinder(scene):
    cylinder_side(scene, (0, 0, 0), 5, 10)
    for z, up in ((0, False), (10, True)):
        disc(scene, (0, 0, z), 5, up)
        scene.edges.append(circle((0, 0, z), 5))


def bracket(scene):
    """A bracket of two plates, the upright one with a bore."""
    profile = np.array([(0, 0), (20, 0), (20, 4), (4, 4), (4, 16), (0, 16)], float)
    width = 12.0
    for (x0, z0), (x1, z1) in zip(profile, np.roll(profile, -1, 0)):
        scene.rectangle((x0, 0, z0), (0, width, 0), (x1 - x0, 0, z1 - z0))
        for y in (0, width):
            scene.edges.append(np.array([(x0, y, z0), (x1, y, z1)], float))
        scene.edges.append(np.array([(x0, 0, z0), (x0, width, z0)], float))
    for y, sign in ((0, True), (width, False)):
        scene.rectangle((0, y, 0), (20, 0, 0), (0, 0, 4), flip=not sign)
        scene.rectangle((0, y, 4), (4, 0, 0), (0, 0, 12), flip=not sign)


def rooms(apart):
    def make(scene):
        scene.box((0, 0, 0), (14, 14, 10))
        scene.box((14 + apart, 0, 0), (28 + apart, 14, 10))
    return make


def room(scene):
    """Scanned from inside: walls, floor, ceiling, a cabinet and a table, a door."""
    scene.box((0, 0, 0), (6, 4, 2.5), inward=True, without=("x0",))
    scene.rectangle((0, 0, 0), (0, 4, 0), (0, 0, 2.5), holes=((0.4, 0.65, 0, 0.8),))
    scene.box((0.02, 3.4, 0.0), (1.5, 4, 2.0), without=("y1", "z0"))
    scene.box((3, 1.5, 0.72), (4.5, 2.3, 0.76))
    for x in (3.05, 4.4):
        for y in (1.55, 2.2):
            scene.box((x, y, 0), (x + 0.06, y + 0.06, 0.72), without=("z0", "z1"))
    scene.edges.clear()


def facade(scene):
    """A house front, scanned from the street: windows are set back."""
    columns, rows, wide, high = 5, 3, 20.0, 10.0
    holes = []
    for i in range(columns):
        for j in range(rows):
            u0, v0 = (i + 0.3) / columns, (j + 0.25) / rows
            holes.append((u0, u0 + 0.4 / columns, v0, v0 + 0.5 / rows))
    scene.rectangle((0, 0, 0), (wide, 0, 0), (0, 0, high), holes=holes)
    for u0, u1, v0, v1 in holes:
        scene.box((u0 * wide, 0, v0 * high), (u1 * wide, 0.25, v1 * high), inward=True, without=("y0",))
    scene.edges.clear()


def hills(x, y):
    return 2 * np.sin(0.11 * x) * np.cos(0.07 * y) + 0.8 * np.sin(0.31 * x + 0.2 * y)


def terrain(scene):
    """Scanned from the air: ground, houses with saddle roofs, crowns of trees; few points on walls."""
    houses = [(15, 20), (40, 15), (60, 55), (25, 60)]

    def ground(n):
        p = scene.random.random((n, 2)) * 80
        for x, y in houses:
            p = p[~((np.abs(p[:, 0] - x) < 6) & (np.abs(p[:, 1] - y) < 4))]
        slope = np.stack([-(0.22 * np.cos(0.11 * p[:, 0]) * np.cos(0.07 * p[:, 1]) + 0.248 * np.cos(0.31 * p[:, 0] + 0.2 * p[:, 1])),
                          0.14 * np.sin(0.11 * p[:, 0]) * np.sin(0.07 * p[:, 1]) - 0.16 * np.cos(0.31 * p[:, 0] + 0.2 * p[:, 1]),
                          np.ones(len(p))], 1)
        return np.column_stack([p, hills(p[:, 0], p[:, 1])]), slope / np.linalg.norm(slope, axis=1)[:, None]

    scene.surface(6400, ground)
    for x, y in houses:
        z = hills(x, y) + 5
        for side in (-1, 1):
            scene.rectangle((x - 6, y + side * 4, z), (12, 0, 0), (0, -side * 4, 2.5), flip=side > 0)
    for x, y in [(50, 40), (55, 30), (10, 45), (70, 20), (35, 40)]:
        def crown(n, x=x, y=y):
            v = scene.random.normal(size=(n, 3))
            v[:, 2] = np.abs(v[:, 2])
            v /= np.linalg.norm(v, axis=1)[:, None]
            return np.array([x, y, hills(x, y) + 4]) + 3 * v, v
        scene.surface(2 * np.pi * 9, crown)


def leaf(scene):
    def draw(n):
        p = scene.random.random((2 * n, 2)) * 2 - 1
        p = p[np.abs(p[:, 1]) < 0.5 * (1 - p[:, 0] ** 2)][:n]
        z = 0.3 * p[:, 0] ** 2 + 0.2 * p[:, 1] ** 2
        up = np.stack([-0.6 * p[:, 0], -0.4 * p[:, 1], np.ones(len(p))], 1)
        return np.column_stack([p, z]), up / np.linalg.norm(up, axis=1)[:, None]
    scene.surface(1, draw)


SCENES = {  # name: (function that makes it, number of points)
    "box": (box, 6000),
    "cylinder": (cylinder, 6000),
    "bracket": (bracket, 10000),
    "rooms_touch": (rooms(0), 12000),
    "rooms_gap": (rooms(0.8), 12000),
    "room": (room, 60000),
    "facade": (facade, 40000),
    "terrain": (terrain, 60000),
    "leaf": (leaf, 5000),
}


def lidar(random):
    """Rings of a vehicle lidar in a street between two rows of houses with parked cars."""
    turn = np.linspace(0, 2 * np.pi, 1800, endpoint=False)
    rays = []
    for ring in np.radians(np.linspace(-24, 4, 32)):
        rays.append(np.stack([np.cos(ring) * np.cos(turn), np.cos(ring) * np.sin(turn), np.full_like(turn, np.sin(ring))], 1))
    rays = np.concatenate(rays)
    far = np.full(len(rays), 60.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        ground = -1.8 / rays[:, 2]
        far = np.where((ground > 0) & (ground < far), ground, far)
        boxes = [((-60, 8, -1.8), (60, 9, 6)), ((-60, -9, -1.8), (60, -8, 6))]
        boxes += [((x, y, -1.8), (x + 4.2, y + 1.7, -0.4)) for x in range(-30, 30, 7) for y in (3.5, -5.2)]
        for low, high in boxes:
            a, b = np.asarray(low) / rays, np.asarray(high) / rays
            enter, leave = np.minimum(a, b).max(1), np.maximum(a, b).min(1)
            far = np.where((enter > 0) & (enter <= leave) & (enter < far), enter, far)
    seen = far < 60
    return rays[seen] * (far[seen] + random.normal(0, 0.02, seen.sum()))[:, None]


def odd_clouds():
    """Clouds for which no true surface is known."""
    random = np.random.default_rng(2)
    v = random.normal(size=(20000, 3))
    ball = v / np.linalg.norm(v, axis=1)[:, None] * random.random((20000, 1)) ** (1 / 3)
    t = np.linspace(0, 1, 1500)
    wire = np.stack([10 * t, np.sin(6 * t), np.cos(4 * t)], 1) + random.normal(0, 0.002, (1500, 3))
    return {"lidar": lidar(random), "filled_ball": ball, "wire": wire, "two_points": np.array([(0.0, 0, 0), (1, 0, 0)]),
            "three_points": np.array([(0.0, 0, 0), (1, 0, 0), (0, 1, 0)])}


def run(command, limit):
    """(exit code, CPU seconds, output)"""
    child = subprocess.Popen(["timeout", str(limit), *command], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    text = child.stdout.read().decode(errors="replace") or child.stderr.read().decode(errors="replace")
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    return child.returncode, usage.ru_utime + usage.ru_stime, text


def write_points(path, points, normals):
    names = ["x", "y", "z"] + (["nx", "ny", "nz"] if normals is not None else [])
    values = points if normals is None else np.hstack([points, normals])
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n"
    with open(path, "wb") as file:
        file.write((header + "".join(f"property float {name}\n" for name in names) + "end_header\n").encode())
        file.write(np.ascontiguousarray(values, "<f4").tobytes())


def measure(mesh, cloud, truth, edges, random):
    vertices, triangles = ply.read(mesh)
    cloud = np.unique(cloud, axis=0)
    apart = np.median(cKDTree(cloud).query(cloud, k=2)[0][:, 1]) * 2
    found = clouds.sample(vertices, triangles, 200000, random)
    row = {"triangles": len(triangles), "spacing": apart}
    row["bare"] = float((cKDTree(cloud).query(found)[0] > 3 * apart).mean())
    if truth is not None:
        # Distance to the tangential plane of the nearest true sample; to the sample itself if it is farther than 3
        # spacings, so that the mesh has no counterpart there.
        tree = cKDTree(truth[0])
        away, nearest = tree.query(found)
        offset = np.abs(np.einsum("ij,ij->i", found - truth[0][nearest], truth[1][nearest]))
        row["mean_to"] = float(np.where(away < 3 * apart, np.minimum(offset, away), away).mean() / apart)
        own = cKDTree(found)
        row["mean_from"] = float(own.query(truth[0][:100000])[0].mean() / apart)
    else:
        row["mean_from"] = float(cKDTree(found).query(cloud)[0].mean() / apart)
    if len(edges):
        middles = vertices[triangles].mean(1)
        by_edges = triangles[cKDTree(edges).query(middles)[0] < 3 * apart]
        dense = cKDTree(clouds.sample(vertices, by_edges, 3000000, random))
        row["edges"] = float(dense.query(edges)[0].mean() / apart)
    return row


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--covol", required=True)
    parser.add_argument("--timeout", type=float, default=300, help="seconds")
    parser.add_argument("--only", default="")
    parser.add_argument("--results", type=pathlib.Path, default=HERE / "results")
    parser.add_argument("--noise", type=float, default=0.0, help="standard deviation along each axis, in spacings")
    parser.add_argument("--clouds", type=pathlib.Path, help="further clouds, .ply")
    parser.add_argument("--options", default="", help="further options of covol reconstruct")
    parser.add_argument("--keep", type=pathlib.Path, help="folder for clouds, meshes and reports")
    options = parser.parse_args()
    only = set(filter(None, options.only.split(",")))
    jobs = []
    for name, (make, count) in SCENES.items():
        for given in (False, True):
            full = name + ("+normals" if given else "")
            if only and full not in only and name not in only:
                continue
            scene = Scene()
            make(scene)
            points, normals = scene.points(count)
            truth = scene.points(1000000)
            apart = np.sqrt(sum(face[0] for face in scene.faces) / count)
            points = points + scene.random.normal(0, 1, points.shape) * options.noise * apart
            jobs.append((full, points, normals if given else None, truth, scene.edge_points(0.02)))
    for name, points in odd_clouds().items():
        if not only or name in only:
            jobs.append((name, points, None, None, ()))
    for path in sorted(options.clouds.glob("*.ply")) if options.clouds else ():
        if not only or path.stem in only:
            jobs.append((path.stem, ply.read(path)[0], None, None, ()))
    rows = []
    options.results.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="covol-scenes-") as folder:
        folder = options.keep or pathlib.Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        for name, points, normals, truth, edges in jobs:
            cloud, mesh, report = (folder / f"{name}{end}" for end in ("_in.ply", ".ply", ".json"))
            write_points(cloud, points, normals)
            command = [options.covol, "reconstruct", str(cloud), "-o", str(folder / f"{name}.vdb"), "--mesh", str(mesh),
                       "--json", str(report), "--quiet", *options.options.split()]
            code, cpu, text = run(command, options.timeout)
            row = {"scene": name, "points": len(points), "cpu_s": round(cpu, 2), "code": code}
            if code == 0 and mesh.exists():
                row |= measure(mesh, points, truth, edges, np.random.default_rng(3))
                reported = json.loads(report.read_text())
                row |= {key: reported["surface"][key] for key in ("components", "genus", "closed")}
                row["mib"] = reported["peak_rss_bytes"] >> 20
                row["warnings"] = " | ".join(str(w.get("text", w) if isinstance(w, dict) else w)[:160] for w in reported.get("warnings", []))
            else:
                row["warnings"] = text.strip()[-300:]
            rows.append(row)
            print({k: (round(v, 4) if isinstance(v, float) else v) for k, v in row.items()}, flush=True)
    columns = list(dict.fromkeys(key for row in rows for key in row))
    with open(options.results / "scenes.csv", "w", newline="") as file:
        writer = csv.DictWriter(file, columns)
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()
