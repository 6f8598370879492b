"""Bodies that are cut by the image's end: how does covol's result end there?

    /usr/bin/python3 tests/bench/marks/cut.py [--covol BINARY] [--quick] [--check]

A sphere and an ellipsoid, bright in a noisy image, 20, 50 or 80 % of their height beyond its end: beyond its first slice, half of
that beyond the first and half beyond the last slice, or (20 and 50 %) beyond two faces that meet. The image ends half a voxel
beyond its outermost voxel centres. Exact marks lie on the part of the surface within the image, as dense as 150 on the whole; on
the cut there are none, or some along the outline in the end slice, or some all over the end slice. Reported are, over the draws,

  end slice   voxels of covol's mask in the end slices over the true ones, for the worse end
  volume      volume of the mesh over that of the body within the image
  collar      how far the mask reaches beyond the true end slice in that slice, voxels
  beyond      how far the mesh reaches beyond the image, voxels
  cap         how far the mesh lies from the image's end where the body is cut, voxels

Accepted: end slices within 3 %, volumes within 1 %, nothing beyond the image and caps flat to a tenth of a voxel.
"""
import sys

import numpy as np
import tifffile
from scipy import ndimage

import bodies
from common import Bench, markdown, version_of, write_marks

MARKS = 150  # number of marks on the whole body, of which those in the image are used
SPACINGS = {"1:1:1": np.array([1.0, 1, 1]), "1:1:5": np.array([1.0, 1, 5])}
SHAPES = {"sphere": (15, 15, 15), "ellipsoid": (14, 11, 15)}
CUTS = [(faces, fraction) for faces in ("one", "two ends", "corner") for fraction in (0.2, 0.5, 0.8) if (faces, fraction) != ("corner", 0.8)]
ON_THE_CUT = ("none", "outline", "all over")
OPTIONS = {"marks alone": ("--rho", 0), "both": ()}
# Accepted maxima. END_SLICE: relative error of the area of the body on an end face of the image. VOLUME: relative error
# of the volume. FLAT: distance of the surface beyond the image, and of the part that closes the body at an end face
# from this face; in units of the smallest spacing.
END_SLICE, VOLUME, FLAT = 0.03, 0.01, 0.1
BRIGHT, DARK, NOISE = 180, 60, 15


class Scene:
    """A body, and an image whose end cuts it."""

    def __init__(self, shape, spacing, faces, fraction, rng):
        self.spacing = spacing
        radii = np.array(SHAPES[shape], float)
        around = 6 + 2 * spacing
        sizes = np.ceil(2 * (radii + around) / spacing)
        centre = spacing * ((sizes - 1) / 2 + rng.uniform(-0.5, 0.5, 3))
        # Length of the body beyond an end of the image, along each axis.
        beyond = 2 * radii * fraction + rng.uniform(-0.5, 0.5) * spacing
        # Ends of the image that cut the body: (axis, 0: low end or 1: high end).
        self.ends = {"one": [(2, 0)], "two ends": [(2, 0), (2, 1)], "corner": [(2, 0), (0, 0)]}[faces]
        if faces == "two ends":
            sizes[2] = max(3, round((2 * radii[2] - beyond[2]) / spacing[2]))
            centre[2] = spacing[2] * (sizes[2] - 1) / 2
        else:
            for axis, _ in self.ends:
                centre[axis] = radii[axis] - beyond[axis] - spacing[axis] / 2
                sizes[axis] = np.ceil((centre[axis] + radii[axis] + around[axis]) / spacing[axis])
        self.sizes, self.body = sizes.astype(int), bodies.Ellipsoid(tuple(radii), centre)
        z, y, x = np.meshgrid(*[spacing[a] * np.arange(self.sizes[a]) for a in (2, 1, 0)], indexing="ij")
        self.centres = np.stack([x, y, z], -1)
        self.truth = self.body.inside(self.centres)
        self.low, self.high = -spacing / 2, spacing * (self.sizes - 0.5)

    def write_image(self, path, rng):
        height = self.body.distance(self.centres.reshape(-1, 3)).reshape(self.truth.shape)
        values = DARK + (BRIGHT - DARK) * np.clip(0.5 - height, 0, 1) + rng.normal(0, NOISE, height.shape)
        bodies.write_image(path, np.clip(values, 0, 255).astype(np.uint8), self.spacing)

    def end_slice(self, mask, axis, high):
        return np.take(mask, -1 if high else 0, 2 - axis)

    def marks(self, on_the_cut, rng):
        """Transforms to world units."""
        whole = bodies.even_points(self.body, MARKS, rng)
        inside = ((whole >= 0) & (whole <= self.spacing * (self.sizes - 1))).all(1)
        marks = [whole[inside]]
        for axis, high in self.ends if on_the_cut != "none" else []:
            at = self.spacing[axis] * (self.sizes[axis] - 1) * high
            others = [a for a in range(3) if a != axis]
            shrink = np.sqrt(max(0, 1 - ((at - self.body.centre[axis]) / self.body.radii[axis]) ** 2))
            radii = self.body.extent[others] * shrink
            apart = np.sqrt(self.body_area() / MARKS)
            flat = [self._around(radii, apart)] if on_the_cut == "outline" else \
                [self._around(radii * r, apart) for r in np.arange(1, 0, -apart / radii.max())]
            positions = np.full((sum(map(len, flat)), 3), at)
            positions[:, others] = np.concatenate(flat) + self.body.centre[others]
            inside = ((positions >= 0) & (positions <= self.spacing * (self.sizes - 1))).all(1)
            marks.append(positions[inside])
        return np.concatenate(marks)

    def body_area(self):
        """Area of an ellipsoid by Thomsen's formula, within 1 %."""
        a, b, c = self.body.extent**1.6
        return 4 * np.pi * ((a * b + a * c + b * c) / 3) ** (1 / 1.6)

    @staticmethod
    def _around(radii, apart):
        turns = np.linspace(0, 2 * np.pi, max(3, round(2 * np.pi * radii.mean() / apart)), endpoint=False)
        return np.stack([radii[0] * np.cos(turns), radii[1] * np.sin(turns)], 1)

    def height_above(self, foot, axis, high):
        """Of the body above positions on an end face, within the image."""
        away = (foot - self.body.centre) / self.body.radii
        away[:, axis] = 0
        chord = self.body.radii[axis] * np.sqrt(np.maximum(0, 1 - (away**2).sum(1)))
        height = chord + (-1 if high else 1) * (self.body.centre[axis] - foot[:, axis])
        return np.minimum(height, self.high[axis] - self.low[axis])

    def measure(self, mask, vertices, triangles):
        ends, collars, caps = [], [], []
        for axis, high in self.ends:
            mine, true = self.end_slice(mask, axis, high), self.end_slice(self.truth, axis, high)
            ends.append(np.count_nonzero(mine) / np.count_nonzero(true))
            spacing = self.spacing[[a for a in (2, 1, 0) if a != axis]]
            away = ndimage.distance_transform_edt(~true, spacing)
            collars.append(away[mine].max() if mine.any() else 0.0)
            face = self.high[axis] if high else self.low[axis]
            foot = vertices.copy()
            foot[:, axis] = face
            # `deep`: vertices whose projections on the end face lie more than 2 units of length inside the body, and
            # that are as far from the other end faces.
            deep = self.body.distance(foot) < -2
            for other, other_high in self.ends:
                if other != axis:
                    deep &= np.abs(vertices[:, other] - (self.high[other] if other_high else self.low[other])) > 2
            cap = deep & (np.abs(vertices[:, axis] - face) < 0.5 * self.height_above(foot, axis, high))
            caps.append(np.abs(vertices[cap, axis] - face).max() if cap.any() else np.inf)
        beyond = np.maximum(self.low - vertices, vertices - self.high).max()
        return {"end_slice": float(max(ends, key=lambda r: abs(r - 1))), "collar": float(max(collars)),
                "beyond": float(max(0, beyond)), "cap": float(np.max(caps)),
                "volume": bodies.enclosed(vertices, triangles) / self.body.volume_in(self.low, self.high)}


def run(bench, shape, spacing, faces, fraction, on_the_cut, options, draw):
    rng = np.random.default_rng([list(SHAPES).index(shape), int(spacing[2]), CUTS.index((faces, fraction)), draw])
    scene = Scene(shape, spacing, faces, fraction, rng)
    image, mesh, mask = (bench.covol.work / name for name in ("cut.tif", "cut.ply", "cut_mask.tif"))
    scene.write_image(image, rng)
    marks = write_marks(bench.covol.work / "marks.csv", scene.marks(on_the_cut, rng))
    mesh.unlink(missing_ok=True)
    code, seconds, _ = bench.covol.run("segment", image, "--points", marks, *options, "-o", bench.covol.work / "s.vdb",
                                       "--mesh", mesh, "--mask", mask)
    measured = scene.measure(tifffile.imread(mask) > 0, *bodies.read_mesh(mesh)) if code == 0 else {}
    return {"code": code, "seconds": seconds} | measured


def summary(rows, keys):
    reported, groups = [], {}
    for row in rows:
        groups.setdefault(tuple(row[k] for k in keys), []).append(row)
    for values, members in groups.items():
        done = [m for m in members if m["code"] == 0]
        one = dict(zip(keys, values)) | {"draws": len(members), "failures": len(members) - len(done)}
        if done:
            one |= {key: max((m[key] for m in done), key=lambda v: abs(v - 1)) for key in ("end_slice", "volume")}
            one |= {key: float(np.max([m[key] for m in done])) for key in ("collar", "beyond", "cap")}
        one["accepted"] = "yes" if not one["failures"] and abs(one["end_slice"] - 1) <= END_SLICE and \
            abs(one["volume"] - 1) <= VOLUME and max(one["beyond"], one["cap"]) <= FLAT else "no"
        reported.append(one)
    return reported


def cell(key, value):
    if not isinstance(value, float) or key == "fraction":
        return str(value)
    return f"{100 * (value - 1):+.1f} %" if key in ("end_slice", "volume") else f"{value:.2f}"


def main():
    bench = Bench("cut", __doc__, 3, structures_needed=False, arguments=lambda parser: parser.add_argument(
        "--check", action="store_true", help="exit code 1 when something is not accepted"))
    version = bench.covol.version + version_of(bodies, sys.modules[__name__])
    rows = []
    for shape in SHAPES:
        for name, spacing in list(SPACINGS.items())[:1 if bench.quick else None]:
            for faces, fraction in CUTS:
                for on_the_cut in ON_THE_CUT:
                    for how, options in OPTIONS.items():
                        for draw in range(bench.draws):
                            what = {"shape": shape, "spacing": name, "faces": faces, "fraction": fraction, "marks_on_the_cut": on_the_cut,
                                    "with": how, "draw": draw}
                            rows.append(what | bench.once(what.values(), lambda: run(
                                bench, shape, spacing, faces, fraction, on_the_cut, options, draw), version))
    bench.write("cut_draws", rows)
    keys = ("shape", "spacing", "faces", "fraction", "marks_on_the_cut", "with")
    reported = summary(rows, keys)
    bench.write("cut", reported)
    shown = (*keys, "end_slice", "volume", "collar", "beyond", "cap", "failures", "accepted")
    good = sum(t["accepted"] == "yes" for t in reported)
    bench.write_text("# Bodies cut by the image's end: the draw that is farthest off",
                     markdown([{key: cell(key, t.get(key, "")) for key in shown} for t in reported]),
                     f"{good} of {len(reported)} accepted.")
    return 1 if good < len(reported) and bench.options.check else 0


if __name__ == "__main__":
    sys.exit(main())
