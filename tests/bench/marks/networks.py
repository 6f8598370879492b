"""Sections of meshes in planes of any direction: how accurate is covol's body between them?

    /usr/bin/python3 tests/bench/marks/networks.py MESH.stl... [--covol BINARY] [--planes 12] [--draws 3]

Each mesh is cut by planes in one family of parallel ones, in two and three families at right angles, and in random directions; the
sections are written as a .csl file, and `covol reconstruct --contours` makes the body. Each arrangement is compared with
shape-based interpolation (covol's own between parallel contours: Raya and Udupa 1990, Herman et al. 1992) of its largest family of
parallel planes, or, if it has none, of as many parallel planes. Reported are the mean distance between the surfaces, both ways, in
per cent of the mesh's diagonal, pieces and genus, and CPU seconds.

Meshes to use: `eight`, `hand`, `ok` and `mammoth` of https://github.com/iamsalvatore/cross_sdf (MIT).
"""
import argparse
import json
import os
import pathlib
import resource
import subprocess
import sys
import tempfile

import numpy as np

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
from tables import markdown  # noqa: E402


def read_stl(path):
    """Vertices and triangles of a binary STL; equal corners become one vertex."""
    data = pathlib.Path(path).read_bytes()
    count = int.from_bytes(data[80:84], "little")
    rows = np.frombuffer(data, np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("two", "<u2")]), count, 84)
    vertices, faces = np.unique(rows["corners"].reshape(-1, 3), axis=0, return_inverse=True)
    return vertices.astype(float), faces.reshape(-1, 3)


def cut(vertices, faces, normal, offset):
    """The loops in the plane normal . x = offset, without vertices that are closer than a thousandth of the extent."""
    height = vertices @ normal - offset
    height[height == 0] = 1e-12  # every vertex is on one side: no case of a vertex in the plane
    above = height[faces] > 0
    crossed = faces[above.any(1) & ~above.all(1)]
    to = {}
    places = {}
    for triangle in crossed:
        ends = []
        for a, b in zip(triangle, np.roll(triangle, -1)):
            if (height[a] > 0) != (height[b] > 0):
                key = (min(a, b), max(a, b))
                t = height[key[0]] / (height[key[0]] - height[key[1]])
                places[key] = vertices[key[0]] + t * (vertices[key[1]] - vertices[key[0]])
                ends.append((key, height[a] > 0))
        start, end = (ends[0][0], ends[1][0]) if ends[0][1] else (ends[1][0], ends[0][0])
        to[start] = end
    minimum = 1e-3 * np.ptp(vertices, axis=0).max()
    loops = []
    while to:
        first, key = to.popitem()
        loop = [places[first]]
        while key in to:
            if np.linalg.norm(places[key] - loop[-1]) > minimum:
                loop.append(places[key])
            key = to.pop(key)
        if len(loop) >= 4:
            loops.append(np.array(loop))
    return loops


def write_csl(path, planes):
    """@param planes  (normal, offset, loops)"""
    with open(path, "w") as file:
        file.write(f"CSLC\n{len(planes)} 2\n\n")
        for n, (normal, offset, loops) in enumerate(planes, 1):
            file.write("%d %d %d %.9g %.9g %.9g %.9g\n\n" % (n, sum(map(len, loops)), len(loops), *normal, -offset))
            for loop in loops:
                np.savetxt(file, loop, "%.9g")
            begin = 0
            for loop in loops:
                file.write(" ".join(map(str, [len(loop), 1, *range(begin, begin + len(loop))])) + "\n")
                begin += len(loop)


def parallel(vertices, normal, count):
    low, high = np.percentile(vertices @ normal, (0, 100))
    return [(normal, low + (n + 0.5) * (high - low) / count) for n in range(count)]


def arrangements(vertices, count, rng):
    """By the arrangement's name: its planes, and those for the other method."""
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0].T
    yield "one family", parallel(vertices, axes[0], count), parallel(vertices, axes[0], count)
    for name, families in (("two families", 2), ("three families", 3)):
        each = count // families
        planes = [plane for axis in axes[:families] for plane in parallel(vertices, axis, each)]
        yield name, planes, parallel(vertices, axes[0], each)
    middle, normals = (vertices.min(0) + vertices.max(0)) / 2, rng.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    spread = np.ptp(vertices, axis=0) * rng.uniform(-0.35, 0.35, (count, 3))
    yield "random", [(n, n @ (middle + d)) for n, d in zip(normals, spread)], parallel(vertices, axes[0], count)


def on_surface(vertices, faces, count, rng):
    corners = vertices[faces]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    which = rng.choice(len(faces), count, p=areas / areas.sum())
    a, b = np.sqrt(rng.random(count)), rng.random(count)
    weights = np.stack([1 - a, a * (1 - b), a * b], 1)
    return np.einsum("nc,ncx->nx", weights, corners[which])


def reconstruct(options, folder, planes, mesh, rng):
    from scipy.spatial import cKDTree  # distances are measured between dense samples of the surfaces
    vertices, faces = mesh
    cuts = [(normal, offset, cut(vertices, faces, normal, offset)) for normal, offset in planes]
    cuts = [one for one in cuts if one[2]]
    write_csl(folder / "s.csl", cuts)
    diagonal = np.linalg.norm(np.ptp(vertices, axis=0))
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([options.covol, "reconstruct", "--contours", folder / "s.csl", "--contour-curve", "lines",
                           "--voxel-size", str(diagonal / options.voxels), "-o", folder / "s.vdb", "--mesh", folder / "s.stl", "--json", folder / "r.json"],
                          capture_output=True, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    if done.returncode != 0:
        print(done.stderr)
        return {"error, %": np.nan, "pieces": "-", "genus": "-", "CPU s": round(seconds, 1)}
    surface = json.loads((folder / "r.json").read_text())["surface"]
    count = 20000
    true, found = on_surface(*mesh, count, rng), on_surface(*read_stl(folder / "s.stl"), count, rng)
    error = (cKDTree(true).query(found)[0].mean() + cKDTree(found).query(true)[0].mean()) / 2
    # Mean distance between two independent samples of the same surface. It is subtracted, because it is due to the
    # spacing of the samples.
    floor = cKDTree(true).query(on_surface(*mesh, count, rng))[0].mean()
    return {"error, %": 100 * max(error - floor, 0) / diagonal, "pieces": surface["components"], "genus": surface["genus"],
            "CPU s": round(seconds, 1)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("meshes", nargs="+")
    parser.add_argument("--covol", default=os.environ.get("COVOL", "build/bin/covol"))
    parser.add_argument("--planes", type=int, default=12)
    parser.add_argument("--draws", type=int, default=1)
    parser.add_argument("--voxels", type=float, default=150, help="along the mesh's diagonal")
    options = parser.parse_args()
    rows = []
    for path in options.meshes:
        mesh = read_stl(path)
        for draw in range(options.draws):
            rng = np.random.default_rng(draw)
            for name, planes, rival in arrangements(mesh[0], options.planes, rng):
                with tempfile.TemporaryDirectory(prefix="covol-networks-") as folder:
                    ours = reconstruct(options, pathlib.Path(folder), planes, mesh, np.random.default_rng(7))
                    theirs = ours if name == "one family" else reconstruct(options, pathlib.Path(folder), rival, mesh, np.random.default_rng(7))
                rows.append({"mesh": pathlib.Path(path).stem, "draw": draw, "planes": name}
                            | {key: value for what in ours for key, value in ((what, ours[what]), (f"shape-based: {what}", theirs[what]))})
                print(rows[-1], flush=True)
    print(markdown(rows))


if __name__ == "__main__":
    main()
