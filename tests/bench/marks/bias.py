"""Does covol shrink bodies whose marks are exact? Sphere, ellipsoid and torus with 50, 300 and 3,000 exact points, without an
image.

    /usr/bin/python3 tests/bench/marks/bias.py [--covol BINARY] [--quick] [--check]

The points are spread as a person's are (each far from those before) and lie exactly on the shape; the image is blank and has no
influence (--rho 0). Voxels are cubes, or five times as long in z. Reported are the mean signed distance of covol's mesh from the
shape in voxels of the smallest spacing (over the area; negative: inside) and the enclosed volume over the true one; the median of
the draws and the worst one. Accepted: a mean of at most 0.02 voxel (0.05 with 50 points), and a volume within 0.5 %.
"""
import sys

import numpy as np

import bodies
from common import Bench, markdown, version_of, write_marks

COUNTS = (50, 300, 3000)
SPACINGS = {"1:1:1": np.array([1.0, 1, 1]), "1:1:5": np.array([1.0, 1, 5])}
# Accepted maxima. Mean signed distance from the true surface, in units of the smallest spacing: MEAN with 300 and 3000
# marks, MEAN_OF_FEW with 50. VOLUME: relative error of the volume.
MEAN, MEAN_OF_FEW, VOLUME = 0.02, 0.05, 0.005
SHAPES = {"sphere": lambda c: bodies.sphere(15, c), "ellipsoid": lambda c: bodies.Ellipsoid((14, 11, 15), c),
          "torus": lambda c: bodies.Torus(16, 7, c)}


def shape_in_image(shape, spacing, rng):
    """A body at a random position relative to the voxels, and the size of an image with a margin around it."""
    around = 6 + 2 * spacing
    extent = SHAPES[shape](np.zeros(3)).extent
    sizes = np.ceil(2 * (extent + around) / spacing).astype(int)
    return SHAPES[shape](spacing * ((sizes - 1) / 2 + rng.uniform(-0.5, 0.5, 3))), sizes


def run(bench, shape, spacing, count, draw):
    rng = np.random.default_rng([list(SHAPES).index(shape), int(spacing[2]), count, draw])
    body, sizes = shape_in_image(shape, spacing, rng)
    image, mesh = bench.covol.work / "blank.tif", bench.covol.work / "mesh.ply"
    bodies.write_image(image, np.zeros(sizes[::-1], np.uint8), spacing)
    marks = write_marks(bench.covol.work / "marks.csv", bodies.even_points(body, count, rng))
    mesh.unlink(missing_ok=True)
    code, seconds, report = bench.covol.run("segment", image, "--points", marks, "--rho", 0, "-o", bench.covol.work / "s.vdb",
                                            "--mesh", mesh)
    if code != 0:
        return {"code": code, "seconds": seconds}
    vertices, triangles = bodies.read_mesh(mesh)
    off = body.distance(vertices)[triangles].mean(1)
    area = bodies.areas(vertices, triangles)
    mean = lambda values: float((values * area).sum() / area.sum())
    return {"code": 0, "seconds": seconds, "mean": mean(off), "rms": float(np.sqrt(mean(off**2))),
            "volume": bodies.enclosed(vertices, triangles) / body.volume, "genus": report["surface"].get("genus")}


def farthest(values, centre):
    return max(values, key=lambda v: abs(v - centre))


def summary(rows):
    reported = []
    groups = {}
    for row in rows:
        groups.setdefault((row["shape"], row["spacing"], row["points"]), []).append(row)
    for (shape, spacing, count), members in groups.items():
        done = [m for m in members if m["code"] == 0]
        one = {"shape": shape, "spacing": spacing, "points": count, "failures": len(members) - len(done)}
        if done:
            means, volumes = [m["mean"] for m in done], [m["volume"] for m in done]
            one |= {"mean_median": float(np.median(means)), "mean_farthest": farthest(means, 0),
                    "rms_median": float(np.median([m["rms"] for m in done])), "volume_median": float(np.median(volumes)),
                    "volume_farthest": farthest(volumes, 1), "seconds_median": float(np.median([m["seconds"] for m in done]))}
        maximum = MEAN_OF_FEW if count == min(COUNTS) else MEAN
        one["accepted"] = "yes" if done and not one["failures"] and abs(one["mean_farthest"]) <= maximum and \
            abs(one["volume_farthest"] - 1) <= VOLUME else "no"
        reported.append(one)
    return reported


def main():
    bench = Bench("bias", __doc__, 5, structures_needed=False, arguments=lambda parser: parser.add_argument(
        "--check", action="store_true", help="exit code 1 when something is not accepted"))
    version = bench.covol.version + version_of(bodies, sys.modules[__name__])
    rows = []
    for shape in SHAPES:
        for name, spacing in SPACINGS.items():
            for count in COUNTS:
                for draw in range(bench.draws):
                    what = {"shape": shape, "spacing": name, "points": count, "draw": draw}
                    rows.append(what | bench.once(what.values(), lambda: run(bench, shape, spacing, count, draw), version))
    bench.write("bias_draws", rows)
    reported = summary(rows)
    bench.write("bias", reported)
    shown = ("shape", "spacing", "points", "mean_median", "mean_farthest", "rms_median", "volume_median", "volume_farthest",
             "failures", "accepted")

    def cell(key, value):
        if not isinstance(value, float):
            return str(value)
        return f"{100 * (value - 1):+.2f} %" if key.startswith("volume") else f"{value:+.4f}"

    good = sum(t["accepted"] == "yes" for t in reported)
    bench.write_text("# Exact points: mean signed distance in voxels (negative: inside), error of the volume",
                     markdown([{key: cell(key, t.get(key, "")) for key in shown} for t in reported]),
                     f"{good} of {len(reported)} accepted.")
    return 1 if good < len(reported) and bench.options.check else 0


if __name__ == "__main__":
    sys.exit(main())
