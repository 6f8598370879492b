"""The jobs of sensitivity.py: clouds and phantoms with known truth, each of about a second, and the error of their results."""
import json
import os
import shlex
import subprocess

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

if os.environ.get("COVOL_DATA"):
    import sensitivity_real as real
else:
    real = None

COUNT = 3000  # default number of points of a cloud


# ---- clouds: f(p) is a distance near its surface, negative inside --------------------------------------------------

def ball(center, radius):
    return lambda p: np.linalg.norm(p - np.array(center), axis=1) - radius


def capsule(a, b, radius):
    a, b = np.array(a, float), np.array(b, float)

    def f(p):
        t = np.clip((p - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
        return np.linalg.norm(p - a - t[:, None] * (b - a), axis=1) - radius
    return f


def torus(major, minor):
    return lambda p: np.hypot(np.hypot(p[:, 0], p[:, 1]) - major, p[:, 2]) - minor


def plate(half, rounding):
    def f(p):
        q = np.abs(p) - (np.array(half) - rounding)
        return np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(1), 0) - rounding
    return f


def union(*parts):
    return lambda p: np.min([part(p) for part in parts], axis=0)


SHAPES = {
    "spikes": union(ball((0, 0, 0), 0.85), capsule((0, 0, 0), (1.4, 0, 0), 0.13), capsule((0, 0, 0), (-0.3, 1.35, 0.2), 0.11),
                    capsule((0, 0, 0), (0, -0.4, -1.35), 0.15)),
    "torus": torus(0.9, 0.3),
    "plate": plate((1, 0.8, 0.08), 0.06),  # its thickness is 4 spacings of the points
    # Two balls with a gap of 2 spacings of the points.
    "twins": union(ball((-0.62, 0, 0), 0.57), ball((0.62, 0, 0), 0.57)),
    "ball": ball((0, 0, 0), 1),
    "rings": union(*[lambda p, c=c: torus(0.42, 0.13)(p - np.array(c)) for c in ((-0.5, -0.4, 0), (0.5, -0.4, 0), (0, 0.47, 0))]),
    # A ball with six needles that are as thick as the distance between the points.
    "needles": union(ball((0, 0, 0), 0.7), *[capsule((0, 0, 0), 1.4 * np.array(d) / np.linalg.norm(d), 0.04)
                                             for d in ((1, 0, 0), (0, 1, 0), (-1, 0.3, 0), (0, -1, 0.4), (0, 0, 1), (0.2, 0.1, -1))]),
}


def normals_at(f, p, step=1e-4):
    n = np.stack([f(p + step * e) - f(p - step * e) for e in np.eye(3)], axis=1)
    return n / np.linalg.norm(n, axis=1, keepdims=True)


def on_surface(f, count, random):
    """Points uniform by area, and their spacing: random positions in a thin shell, projected onto f = 0."""
    p = random.uniform(-1.6, 1.6, (600_000, 3))
    width = 0.03
    p = p[np.abs(f(p)) < width]
    area = len(p) / 600_000 * 3.2 ** 3 / (2 * width)
    p = p[random.permutation(len(p))[:count]]
    for _ in range(3):
        p = p - f(p)[:, None] * normals_at(f, p)
    return p, (area / count) ** 0.5


def write_points(path, points, normals=None):
    table = points if normals is None else np.hstack([points, normals])
    np.savetxt(path, table, "%.6f", ",", header="x,y,z" + ("" if normals is None else ",nx,ny,nz"), comments="")


def write_pcd(path, points, sensor):
    header = f"# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {len(points)}\nHEIGHT 1\n" \
        f"VIEWPOINT {sensor[0]} {sensor[1]} {sensor[2]} 1 0 0 0\nPOINTS {len(points)}\nDATA ascii\n"
    path.write_text(header + "".join("%.6f %.6f %.6f\n" % tuple(p) for p in points))


def make_clouds(folder):
    for number, (name, f) in enumerate(SHAPES.items()):
        np.save(folder / f"{name}.npy", on_surface(f, 10000, np.random.default_rng([number, 0]))[0])

    def draw(name, seed, noise=0.0, outliers=0.0, part=lambda p: np.full(len(p), True), count=COUNT):
        random = np.random.default_rng([seed, 1])
        points, spacing = on_surface(SHAPES[name], count, random)
        points = points[part(points)]
        normals = normals_at(SHAPES[name], points)
        points = points + random.normal(0, noise * spacing, points.shape) if noise else points
        strays = random.uniform(-1.6, 1.6, (int(outliers * len(points)), 3))
        return np.concatenate([points, strays]), np.concatenate([normals, strays])

    def seen_from(direction):
        direction = np.array(direction) / np.linalg.norm(direction)
        return lambda p: normals_at(SHAPES["spikes"], p) @ direction > 0.15

    for name, seed, noise, outliers in (("spikes", 1, 0, 0), ("spikes", 2, 0.5, 0.01), ("torus", 3, 0.3, 0.005), ("torus", 4, 0.9, 0), ("plate", 5, 0.2, 0),
                                        ("plate", 6, 0, 0), ("twins", 7, 0.2, 0.01)):
        write_points(folder / f"{name}{seed}.csv", draw(name, seed, noise, outliers)[0])
    write_points(folder / "hole.csv", draw("torus", 8, 0.2, part=lambda p: (p[:, 0] < 0.8) | (p[:, 2] < 0.05))[0])
    write_points(folder / "half.csv", draw("ball", 9, 0.1, part=lambda p: p[:, 2] > -0.1)[0])
    front = draw("spikes", 10, 0.2, part=seen_from((1, 1, 1)), count=2400)[0]
    write_points(folder / "front.csv", front)
    write_pcd(folder / "front.pcd", front, (6, 6, 6))
    side = draw("spikes", 11, 0.2, part=seen_from((1, 1, -0.5)), count=1200)[0]
    write_points(folder / "layers.csv", np.concatenate([front[::2], side + 0.07]))
    points, normals = draw("torus", 12, 0.2)
    normals[::9] *= -1
    write_points(folder / "normals.csv", points, normals)
    points, normals = draw("plate", 13, 0.1)
    write_points(folder / "normals_plate.csv", points, -normals)
    points, normals = draw("spikes", 14, 0.2)
    write_points(folder / "normals_wrong.csv", points, np.where(points[:, :1] > 0.3, -1, 1) * normals)
    points, normals = draw("plate", 17, 0.9)  # noise moves points across the plate
    write_points(folder / "normals_thin.csv", points, normals)
    for name, shape, seed, noise, count in (("random", "torus", 18, 0.2, COUNT), ("noisy", "spikes", 21, 0.6, 2000)):
        points = draw(shape, seed, noise, count=count)[0]
        normals = np.random.default_rng(seed).normal(size=points.shape)
        write_points(folder / f"normals_{name}.csv", points, normals / np.linalg.norm(normals, axis=1, keepdims=True))
    write_points(folder / "needles.csv", draw("needles", 22, 0.5, count=2500)[0])
    write_points(folder / "thick.csv", draw("torus", 15, 0.7, count=5000)[0])
    # Folds of a ball: those with 30 waves are mistaken for noise, those with 12 are resolved. The walls of those with 16
    # are merged if the cells are too large.
    for waves, depth, count in ((30, 0.2, 10000), (12, 0.3, 10000), (16, 0.3, 8000)):
        directions = np.random.default_rng(20).normal(size=(count, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        write_points(folder / f"folds{waves}.csv", directions * (1 + depth * np.cos(waves * directions).prod(1, keepdims=True)))
    write_points(folder / "few.csv", draw("torus", 16, 0.1, count=700)[0])


def mesh_vertices(path):
    data = path.read_bytes()
    head, body = data.split(b"end_header\n", 1)
    lines = head.decode().split("\n")
    begin = next(n for n, line in enumerate(lines) if line.startswith("element vertex"))
    fields = []
    for line in lines[begin + 1:]:
        if not line.startswith("property"):
            break
        fields.append((line.split()[2], {"float": "<f4", "double": "<f8", "uchar": "u1", "int": "<i4", "uint": "<u4", "float32": "<f4"}[line.split()[1]]))
    table = np.frombuffer(body, np.dtype(fields), int(lines[begin].split()[2]))
    return np.stack([table[a].astype(float) for a in "xyz"], axis=1)


def cloud_error(folder, out, shape, part=None):
    """Mean distance of the mesh from the shape, and of the shape from the mesh beyond 0.05, in % of the shape's half length."""
    vertices = mesh_vertices(out / "s.ply")
    truth = np.load(folder / f"{shape}.npy")
    if part is not None:  # an open surface: only the part of the truth and of the mesh near the points is compared
        truth = truth[cKDTree(part).query(truth)[0] < 0.05]
        vertices = vertices[cKDTree(part).query(vertices)[0] < 0.2]
    missing = np.maximum(0, cKDTree(vertices).query(truth)[0] - 0.05)
    return 100 * float(np.abs(SHAPES[shape](vertices)).mean() + missing.mean())


# ---- phantoms ------------------------------------------------------------------------------------------------------

def read_nrrd(path):
    head, body = path.read_bytes().split(b"\n\n", 1)
    fields = dict(line.split(": ", 1) for line in head.decode().split("\n") if ": " in line)
    if fields["encoding"] in ("gzip", "gz"):
        import gzip
        body = gzip.decompress(body)
    kind = {"float": "<f4", "uint8": "u1", "unsigned char": "u1", "uchar": "u1", "short": "<i2", "uint16": "<u2", "unsigned short": "<u2"}[fields["type"]]
    return np.frombuffer(body, kind).reshape([int(n) for n in fields["sizes"].split()][::-1]), head


MOVED = {"round": (2, -3, 1), "torus": (1, 2, 2), "two": (-2, 1, 0), "box": (1, -1, 2), "sphere": (3, 0, -2), "many": (0, 2, -2)}  # voxels along z, y and x, from one image of a time-lapse to the next


def places():
    """x, y and z of the voxels of a phantom, each an array with the axes z, y, x."""
    at = (np.arange(44) - 21.5) * 2.6 / 44
    return np.meshgrid(at, at, at, indexing="ij")[::-1]


def write_torus_lines(folder, head):
    """An image of the torus whose surface is a bright line, and scribbles inside the torus on every sixth slice."""
    x, y, z = places()
    off = (np.hypot(np.hypot(x, y) - 0.75, z) - 0.3) * 44 / 2.6  # voxels
    line = 20 + 150 * np.exp(-(off / 1.5) ** 2) + np.random.default_rng(19).normal(0, 15, off.shape)
    (folder / "p_line.nrrd").write_bytes(head + line.clip(0, 255).astype("u1").tobytes())
    inside = (off < -1) & (np.abs(np.hypot(x, y) - 0.75) < 0.07) & (np.arctan2(y, x) > -2)
    inside[np.arange(44) % 6 != 3] = False
    (folder / "s_scribbles.nrrd").write_bytes(head + inside.astype("u1").tobytes())


def write_bar(folder, head):
    """A bar whose sections, 15 by 3 voxels, are painted as areas on every sixth slice."""
    x, y, z = places()
    inside = (np.abs(x) < 0.45) & (np.abs(y) < 0.09) & (np.abs(z) < 0.9)
    image = 60 + 100 * inside + np.random.default_rng(21).normal(0, 15, inside.shape)
    (folder / "p_bar.nrrd").write_bytes(head + image.clip(0, 255).astype("u1").tobytes())
    (folder / "l_bar.nrrd").write_bytes(head + inside.astype("u1").tobytes())
    surface = np.argwhere(inside & ~ndimage.binary_erosion(inside) & (z > 0.8))
    (folder / "g_bar.nrrd").write_bytes(head + (inside & (z < 0.58)).astype("u1").tobytes())  # lacks an end; the marks are there
    rim = np.random.default_rng(23).permutation(surface)[:10]
    write_points(folder / "ten_bar.csv", (rim[:, ::-1] - 21.5) * 2.6 / 44)
    inside[np.arange(44) % 6 != 3] = False
    (folder / "s_bar.nrrd").write_bytes(head + inside.astype("u1").tobytes())


def write_handles(folder, head):
    """Marks on three joined rings, and marks on a plate that are less precise than the plate is thick; an image that shows neither."""
    (folder / "p_blank.nrrd").write_bytes(head + np.full(44 ** 3, 100, "u1").tobytes())
    for name, count, noise in (("rings", 400, 0.01), ("plate", 60, 0.1)):
        random = np.random.default_rng([count, 2])
        points = on_surface(SHAPES[name], count, random)[0]
        write_points(folder / f"handles_{name}.csv", points + random.normal(0, noise, points.shape))


def write_faint_sphere(folder, head, labels):
    """An image in which the sphere's contrast is half the standard deviation of the noise."""
    image = 100 + 8 * (labels > 0) + np.random.default_rng(22).normal(0, 16, labels.shape)
    (folder / "p_faint.nrrd").write_bytes(head + image.clip(0, 255).astype("u1").tobytes())


def make_phantoms(folder, covol):
    for name, kind, count, noise in (("round", "sphere-round", 60, 0.1), ("torus", "torus", 80, 0.3), ("two", "two-spheres", 60, 0.2), ("slit", "sphere-slit", 60, 0),
                                     ("many", "torus", 350, 0.2), ("dense", "torus", 1500, 0.2), ("box", "box", 60, 0.2), ("sphere", "sphere", 300, 0.2)):
        subprocess.run([covol, "phantom", kind, "--size", "44", "-o", f"p_{name}.nrrd", "--points", f"p_{name}.csv", "--labels", f"l_{name}.nrrd",
                        "--count", str(count), "--noise", str(noise), "--seed", "3"], cwd=folder, check=True, capture_output=True)
        labels, head = read_nrrd(folder / f"l_{name}.nrrd")
        if name in MOVED:
            for kind in "pl":
                values, own = read_nrrd(folder / f"{kind}_{name}.nrrd")
                moved = np.roll(values, MOVED[name], (0, 1, 2))
                (folder / f"{kind}_{name}_moved.nrrd").write_bytes(own.replace(b"encoding: gzip", b"encoding: raw") + b"\n\n" + np.ascontiguousarray(moved).tobytes())
        raw = head.replace(b"encoding: gzip", b"encoding: raw") + b"\n\n"
        if name in ("torus", "round", "box"):
            wrong = np.roll(labels, (1, 2, 0), (0, 1, 2)) if name == "torus" else labels & np.roll(labels, 3, 0)
            (folder / f"g_{name}.nrrd").write_bytes(raw + np.ascontiguousarray(wrong).tobytes())
            grown = np.max([np.roll(labels, by, axis) for axis in range(3) for by in (-2, 0, 2)], axis=0)
            (folder / f"g_{name}_large.nrrd").write_bytes(raw + np.ascontiguousarray(grown).tobytes())
            painted = np.zeros_like(labels)
            painted[::6] = labels[::6]
            (folder / f"s_{name}.nrrd").write_bytes(raw + painted.tobytes())
        if name == "torus":
            write_torus_lines(folder, raw)
            write_bar(folder, raw)
            write_handles(folder, raw)
        if name == "sphere":
            write_faint_sphere(folder, raw, labels)
        points = np.array([line.split(",")[:3] for line in (folder / f"p_{name}.csv").read_text().splitlines() if line[0] in "-0123456789"], float)
        if name == "many":  # with three accidental marks near corners of the image
            corners = np.array([[1.2, 1.2, 1.2], [-1.2, 1.2, -1.2], [1.2, -1.2, -1.1]])
            np.savetxt(folder / "p_strays.csv", np.concatenate([points, corners]), "%.6f", ",", header="x,y,z", comments="")
        np.savetxt(folder / f"ten_{name}.csv", points[::max(1, len(points) // 10)], "%.6f", ",", header="x,y,z", comments="")
    rows = []
    for k in range(8, 37, 4):  # contours on slices of the torus with radii 0.75 and 0.3; the voxel size is 2.6 / 44
        wide = 0.3 ** 2 - ((k - 21.5) * 2.6 / 44) ** 2
        for number, radius in enumerate((0.75 + wide ** 0.5, 0.75 - wide ** 0.5) if wide > 0 else ()):
            rows += [(k, number, 21.5 + radius * np.cos(t) * 44 / 2.6, 21.5 + radius * np.sin(t) * 44 / 2.6) for t in np.arange(0, 6.28, 0.35)]
    np.savetxt(folder / "contours.csv", rows, "%.4f", ",", header="slice,contour,x_px,y_px", comments="")
    sphere = read_nrrd(folder / "l_sphere.nrrd")[0] > 0
    rows = []
    for k in range(3, 42, 6):
        radius = (sphere[k].sum() / np.pi) ** 0.5
        rows += [(k, 0, 21.5 + radius * np.cos(t), 21.5 + radius * np.sin(t)) for t in np.arange(0, 6.28, 0.35) if radius > 1]
    np.savetxt(folder / "contours_sphere.csv", rows, "%.4f", ",", header="slice,contour,x_px,y_px", comments="")


def mask_error(folder, path, name):
    """1 - Dice, in %."""
    truth, mask = read_nrrd(folder / f"l_{name}.nrrd")[0] > 0, read_nrrd(path)[0] > 0
    return 100 * (1 - 2 * float((truth & mask).sum()) / max(1, float(truth.sum() + mask.sum())))


def doubt_error(out, kind):
    """Number of warnings of right marks, or 10 without a warning of wrong ones."""
    warnings = len(json.loads((out / "r.json").read_text()).get("warnings", []))
    return warnings if kind == "right" else 10 * (warnings == 0)


def of_real(kind):
    """Names of the jobs of this kind (a constant of sensitivity_real.py); none without COVOL_DATA."""
    return getattr(real, kind) if real else []


# ---- jobs ----------------------------------------------------------------------------------------------------------

RECONSTRUCT = "reconstruct ../in/{} --init cloud -o s.vdb --mesh s.ply"
MARKS = "segment ../in/p_{0}.nrrd --points ../in/p_{0}.csv -o s.vdb --mask m.nrrd"
JOBS = {  # name: (arguments of covol, kind of truth, shape, file of the points if the surface is open)
    "spikes": (RECONSTRUCT.format("spikes1.csv"), "cloud", "spikes"),
    "spikes noisy": (RECONSTRUCT.format("spikes2.csv"), "cloud", "spikes"),
    "torus": (RECONSTRUCT.format("torus3.csv"), "cloud", "torus"),
    "torus noisy": (RECONSTRUCT.format("torus4.csv"), "cloud", "torus"),
    "plate noisy": (RECONSTRUCT.format("plate5.csv"), "cloud", "plate"),
    "plate": (RECONSTRUCT.format("plate6.csv"), "cloud", "plate"),
    "twins": (RECONSTRUCT.format("twins7.csv"), "cloud", "twins"),
    "hole": (RECONSTRUCT.format("hole.csv"), "cloud", "torus"),
    "half open": (RECONSTRUCT.format("half.csv") + " --holes open", "open", "ball", "half.csv"),
    "half flat": (RECONSTRUCT.format("half.csv") + " --holes flat", "open", "ball", "half.csv"),
    "front": (RECONSTRUCT.format("front.csv"), "open", "spikes", "front.csv"),
    "front sensor": (RECONSTRUCT.format("front.pcd"), "open", "spikes", "front.csv"),
    "layers": (RECONSTRUCT.format("layers.csv"), "open", "spikes", "layers.csv"),
    "normals": (RECONSTRUCT.format("normals.csv"), "cloud", "torus"),
    "normals plate": (RECONSTRUCT.format("normals_plate.csv"), "cloud", "plate"),
    "normals wrong": (RECONSTRUCT.format("normals_wrong.csv"), "cloud", "spikes"),
    "normals thin": (RECONSTRUCT.format("normals_thin.csv"), "cloud", "plate"),
    "normals noisy": (RECONSTRUCT.format("normals_noisy.csv"), "cloud", "spikes"),
    "needles": (RECONSTRUCT.format("needles.csv"), "cloud", "needles"),
    "normals random": (RECONSTRUCT.format("normals_random.csv"), "cloud", "torus"),
    "thick tag": (RECONSTRUCT.format("thick.csv").replace("cloud", "tag"), "cloud", "torus"),
    "spikes tag": (RECONSTRUCT.format("spikes1.csv").replace("cloud", "tag"), "cloud", "spikes"),
    "twins tag": (RECONSTRUCT.format("twins7.csv").replace("cloud", "tag"), "cloud", "twins"),
    "few": (RECONSTRUCT.format("few.csv").replace("--init cloud ", ""), "cloud", "torus"),
    "plate right": (RECONSTRUCT.format("plate5.csv") + " --json r.json", "doubt", "right"),
    "torus right": (RECONSTRUCT.format("torus4.csv") + " --json r.json", "doubt", "right"),
    "folds right": (RECONSTRUCT.format("folds12.csv") + " --json r.json", "doubt", "right"),
    "folds": (RECONSTRUCT.format("folds16.csv") + " --json r.json", "topology", None),
    "folds wrong": (RECONSTRUCT.format("folds30.csv") + " --json r.json", "doubt", "wrong"),
    "few tag": (RECONSTRUCT.format("few.csv").replace("cloud", "tag"), "cloud", "torus"),
    "cleaned": (RECONSTRUCT.format("spikes2.csv") + " --remove-outliers --smooth wlop", "cloud", "spikes"),
    "relaxed": ("mesh ../in/spikes.vdb -o s.ply --target-edge 2vx", "cloud", "spikes"),
    "adaptive": ("mesh ../in/spikes.vdb -o s.ply --adaptive 0.2vx", "cloud", "spikes"),
    "m round": (MARKS.format("round"), "mask", "round"),
    "m torus": (MARKS.format("torus"), "mask", "torus"),
    "m two": (MARKS.format("two"), "mask", "two"),
    "m box": (MARKS.format("box"), "mask", "box"),
    "m many": (MARKS.format("many"), "mask", "many"),
    "m many alone": (MARKS.format("many") + " --rho 0", "mask", "many"),
    "m strays": (MARKS.format("many").replace("p_many.csv", "p_strays.csv"), "mask", "many"),
    "m torus alone": (MARKS.format("torus") + " --rho 0", "mask", "torus"),
    "m sides": (MARKS.format("two") + " --inside -0.55,0,0 --inside 0.55,0.1,0.05 --outside 0,0.9,0", "mask", "two"),
    "m tag": (MARKS.format("dense") + " --init tag", "mask", "dense"),
    "m tag slit": (MARKS.format("slit") + " --init tag --tag-distance 6vx", "mask", "slit"),
    "m tag sphere": (MARKS.format("sphere") + " --init tag", "mask", "sphere"),
    "m paper": (MARKS.format("dense") + " --model paper", "mask", "dense"),
    "m grow": ("segment ../in/p_sphere.nrrd --theta 0 --init sphere:0,0,0,0.25 -o s.vdb --mask m.nrrd", "mask", "sphere"),
    "m grow box": ("segment ../in/p_box.nrrd --theta 0 --inside 0,0,0 -o s.vdb --mask m.nrrd", "mask", "box"),
    "m coarse": ("segment ../in/p_sphere.nrrd --theta 0 --init sphere:0,0,0,1.1 --voxel-size 0.03 --coarse-levels 1 -o s.vdb --mask m.nrrd", "mask", "sphere"),
    "m init": (MARKS.format("dense") + " --init sphere:0,0,0,1.1", "mask", "dense"),
    "m guess": (MARKS.format("torus").replace("p_torus.csv", "ten_torus.csv") + " --guess ../in/g_torus.nrrd", "mask", "torus"),
    "m guess seed": (MARKS.format("box").replace("p_box.csv", "ten_box.csv") + " --guess ../in/g_box.nrrd --inside -0.8,0,0", "mask", "box"),
    "m guess bar": ("segment ../in/p_bar.nrrd --points ../in/ten_bar.csv --guess ../in/g_bar.nrrd --rho 0 -o s.vdb --mask m.nrrd --json r.json", "doubt", "right"),
    **{f"m handles {name}": (f"segment ../in/p_blank.nrrd --points ../in/handles_{name}.csv --rho 0 -o s.vdb --mask m.nrrd --json r.json", "doubt", kind)
       for name, kind in (("rings", "right"), ("plate", "wrong"))},
    "m guess round": (MARKS.format("round").replace("p_round.csv", "ten_round.csv") + " --guess ../in/g_round.nrrd", "mask", "round"),
    "m guess box": (MARKS.format("box").replace("p_box.csv", "ten_box.csv") + " --guess ../in/g_box.nrrd --rho 0", "mask", "box"),
    "m guess many": (MARKS.format("torus") + " --guess ../in/g_torus.nrrd --rho 0", "mask", "torus"),
    "m guess many round": (MARKS.format("round") + " --guess ../in/g_round.nrrd --rho 0", "mask", "round"),
    "m guess large": (MARKS.format("torus") + " --guess ../in/g_torus_large.nrrd --rho 0", "mask", "torus"),
    "m line": ("segment ../in/p_line.nrrd --contours ../in/contours.csv -o s.vdb --mask m.nrrd", "mask", "torus"),
    "m line marks": ("segment ../in/p_line.nrrd --points ../in/p_torus.csv -o s.vdb --mask m.nrrd", "mask", "torus"),
    "m line tag": ("segment ../in/p_line.nrrd --points ../in/p_dense.csv --init tag -o s.vdb --mask m.nrrd", "mask", "torus"),
    "m scribbles": ("segment ../in/p_torus.nrrd --painted ../in/s_scribbles.nrrd -o s.vdb --mask m.nrrd", "mask", "torus"),
    "m grow torus": ("segment ../in/p_torus.nrrd --theta 0 --inside 0.75,0,0 -o s.vdb --mask m.nrrd", "mask", "torus"),
    "m grow two": ("segment ../in/p_two.nrrd --theta 0 --inside -0.55,0,0 -o s.vdb --mask m.nrrd", "mask", "two"),
    "m grow faint": ("segment ../in/p_faint.nrrd --theta 0 --init sphere:0,0,0,0.25 -o s.vdb --mask m.nrrd", "mask", "sphere"),
    "m grow wide": ("segment ../in/p_sphere.nrrd --theta 0 --init sphere:0,0,0,1.15 -o s.vdb --mask m.nrrd", "mask", "sphere"),
    "m grow many": ("segment ../in/p_many.nrrd --theta 0 --inside 0,0.75,0 -o s.vdb --mask m.nrrd", "mask", "many"),
    **{f"m lapse {name}": (f"segment ../in/p_{name}.nrrd ../in/p_{name}_moved.nrrd --points ../in/p_{name}.csv -o s.vdb --mask m.nrrd", "lapse", f"{name}_moved")
       for name in MOVED},
    "m contours sphere": ("segment ../in/p_sphere.nrrd --contours ../in/contours_sphere.csv -o s.vdb --mask m.nrrd", "mask", "sphere"),
    "m painted round": ("segment ../in/p_round.nrrd --painted ../in/s_round.nrrd -o s.vdb --mask m.nrrd", "mask", "round"),
    "m contours": ("segment ../in/p_torus.nrrd --contours ../in/contours.csv -o s.vdb --mask m.nrrd", "mask", "torus"),
    "m contours alone": ("segment ../in/p_torus.nrrd --contours ../in/contours.csv --rho 0 -o s.vdb --mask m.nrrd", "mask", "torus"),
    "m painted": ("segment ../in/p_torus.nrrd --painted ../in/s_torus.nrrd -o s.vdb --mask m.nrrd", "mask", "torus"),
    "m painted bar": ("segment ../in/p_bar.nrrd --painted ../in/s_bar.nrrd -o s.vdb --mask m.nrrd", "mask", "bar"),
    "m painted box": ("segment ../in/p_box.nrrd --painted ../in/s_box.nrrd --rho 0 -o s.vdb --mask m.nrrd", "mask", "box"),
}
# Lists of jobs for the steps in PLAN, the most informative job first.
CLOUDS = ["spikes noisy", "plate noisy", "torus", "twins", "torus noisy", "needles", "hole", "spikes", "plate"]
SCANS = ["front", "layers", "front sensor", "half open", "hole", "half flat"]
GIVEN = ["normals", "normals plate", "normals wrong", "front sensor", "normals thin", "normals random", "half open", "twins"]
TAGGED = ["m tag", "twins tag", "thick tag", "m tag slit", "m tag sphere", "spikes tag"]
ALONE = ["m torus alone", "few", "m many alone", "m two", "m sides", "m contours alone"]
GUESSED = ["m round", "m torus", "m two", "m box", "m sides", "m many"]
CONTOURS = ["m contours", "m contours alone", "m painted", "m scribbles", "m line", "m painted bar", "m painted box", "m contours sphere", "m painted round"]
CORRECTED = ["m guess", "m guess large", "m guess seed", "m guess round", "m guess box", "m guess many", "m guess many round"]
GROWN = ["m grow", "m grow box", "m grow torus", "m grow two", "m grow wide", "m grow faint", "m grow many"]
LAPSES = [f"m lapse {name}" for name in MOVED]
FLOWS = ["m paper", "m init", "m grow", "few", "m coarse", "m tag"]
LINES = ["m line", "m line marks", "m line tag"]
MESHES = ["relaxed", "adaptive", "spikes", "half open", "half flat", "torus"]
DOUBTED = ["plate right", "folds right", "folds wrong", "torus right", "m guess bar", "m handles rings", "m handles plate", *of_real("DOUBTED")]
PLAN = {  # step of a constant: the jobs in which it is varied
    "common": ["m strays", "spikes noisy", "m torus", "m contours", "m tag", "front", "m grow box", "m guess", "plate", *of_real("FEW_MARKS")[:2], *of_real("ASTRAY_MARKS")[:1]],
    **dict.fromkeys(("cloud", "cloud_scale", "stray", "filled", "indicator", "iteration", "propagation", "local_fit", "crease", "blend", "join_pieces"), CLOUDS),
    "orientation": ["folds", *CLOUDS[:4], "normals noisy", "normals random", *CLOUDS[4:]], **dict.fromkeys(("views", "layers"), SCANS), "given_sides": GIVEN,
    **dict.fromkeys(("tag_distance", "scan_noise"), TAGGED),
    **dict.fromkeys(("guess", "marks_surface"), [*ALONE[:3], *of_real("MARKS_ALONE"), *ALONE[3:]]), "correction": CORRECTED + of_real("OF_GUESSES"),
    "guidance": GUESSED + of_real("FEW_MARKS")[:6] + LAPSES, "inference": [name for kind in ("FEW_MARKS", "ASTRAY_MARKS", "EXPECTED_DICE", "OF_GUESSES") for name in of_real(kind)], "doubts": DOUBTED,
    **dict.fromkeys(("contours", "outline"), [*CONTOURS, *of_real("OF_OUTLINES")[:1]]), "grow": GROWN, "time_lapse": LAPSES,
    **dict.fromkeys(("edge", "evolve", "motion"), [*FLOWS, *LINES, "m contours"]), "flow": [*FLOWS[:3], "m line", "m contours sphere", *of_real("OF_OUTLINES")],
    "automatic": ["spikes noisy", "few", "few tag", "front", "thick tag", "m tag", "m init"], "starts": ["m tag", "m tag slit", "m guess", "hole", "m grow", "few"],
    **dict.fromkeys(("holes", "cut", "relax", "decimate"), MESHES),
}


def make_inputs(folder, covol):
    folder.mkdir(parents=True)
    make_clouds(folder)
    make_phantoms(folder, covol)
    if real:
        JOBS.update(real.make_real(folder))
    subprocess.run([covol, "reconstruct", "spikes1.csv", "--init", "cloud", "-o", "spikes.vdb"], cwd=folder, check=True, capture_output=True)


def arguments_of(job):
    return shlex.split(JOBS[job][0])


def output_of(job, out):
    return out / {"mask": "m.nrrd", "lapse": "m_t001.nrrd", "real": "m.nrrd", "doubt": "r.json", "expected": "r.json", "topology": "r.json"}.get(JOBS[job][1], "s.ply")


def content_of(job, out):
    """The bytes of the result that the error depends on."""
    path = output_of(job, out)
    if path.suffix != ".json":
        return path.read_bytes()
    report = json.loads(path.read_text())
    content = json.dumps([report.get("warnings"), report.get("expected_dice")]).encode()
    more = {"expected": "m.nrrd", "topology": "s.ply"}.get(JOBS[job][1])
    return content + (out / more).read_bytes() if more else content


def error_of(job, folder, out):
    _, kind, shape, *more = JOBS[job]
    if kind in ("mask", "lapse"):
        return mask_error(folder, output_of(job, out), shape)
    if kind == "doubt":
        return doubt_error(out, shape)
    if kind == "topology":  # of a surface that should be one piece without handles
        surface = json.loads((out / "r.json").read_text())["surface"]
        return surface["genus"] + surface["components"] - 1
    if kind == "expected":
        return real.expected_error(folder, out, shape)
    if kind == "real":
        return real.real_error(folder, out, shape)
    return cloud_error(folder, out, shape, np.genfromtxt(folder / more[0], delimiter=",", skip_header=1)[:, :3] if kind == "open" else None)
