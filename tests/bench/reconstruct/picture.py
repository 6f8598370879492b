"""Surfaces side by side: shaded, and coloured by the distance of each point from the true surface."""
import matplotlib
import numpy as np
from PIL import Image
from scipy.spatial import cKDTree

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402

SIZE = 700           # pixels of a panel along its longer side
SAMPLES = 4_000_000  # number of points that are drawn for a surface
LIGHT = np.array([0.4, 0.5, 0.77])
FARTHEST = 0.2       # distance at the end of the colour scale, in % of the diagonal of the true surface


class Panels:
    """A row for each cloud: its points, then the result of each method."""

    def __init__(self):
        self.rows = []

    def add(self, title, cloud, truth, surfaces):
        """@param surfaces  [(name, vertices, triangles)]; cloud: points; truth: (vertices, triangles)"""
        axes = _axes(truth[0])
        low, high = (truth[0] @ axes.T).min(0), (truth[0] @ axes.T).max(0)
        grid = _Grid(low - 0.04 * (high - low), high + 0.04 * (high - low))
        true_points, true_normals = _sampled(*truth, SAMPLES // 4)
        tree = cKDTree(true_points)
        diagonal = np.linalg.norm(np.ptp(truth[0], axis=0))
        row = [(title, grid.draw(cloud @ axes.T, np.full((len(cloud), 3), 0.35)))]
        for name, vertices, triangles in surfaces:
            points, normals = _sampled(vertices, triangles, SAMPLES)
            # Distances are to the tangential plane of the nearest true sample, not to the sample itself, because
            # samples are farther apart than the surfaces.
            distance, nearest = tree.query(points, workers=-1)
            off = np.minimum(distance, np.abs(((points - true_points[nearest]) * true_normals[nearest]).sum(1))) * 100 / diagonal
            colour = pyplot.get_cmap("turbo")(np.clip(off / FARTHEST, 0, 1))[:, :3]
            normals = normals @ axes.T
            normals[normals[:, 2] < 0] *= -1  # the visible side is lit, even if the mesh is inside out
            shade = 0.25 + 0.75 * np.clip(normals @ LIGHT, 0, 1)
            row.append((f"{name}, {off.mean():.3f} %", grid.draw(points @ axes.T, colour * shade[:, None])))
        self.rows.append(row)

    def write(self, path):
        heights = [row[0][1].shape[0] / row[0][1].shape[1] for row in self.rows]
        columns = max(map(len, self.rows))
        figure, axes = pyplot.subplots(len(self.rows), columns, figsize=(4 * columns, 4 * sum(heights) + 0.9), squeeze=False,
                                       gridspec_kw={"height_ratios": heights}, layout="constrained")
        for row, panels in zip(axes, self.rows):
            for axis in row:
                axis.axis("off")
            for axis, (title, picture) in zip(row, panels):
                axis.imshow(picture)
                axis.set_title(title, fontsize=11)
        scale = matplotlib.cm.ScalarMappable(matplotlib.colors.Normalize(0, FARTHEST), "turbo")
        figure.colorbar(scale, ax=axes, orientation="horizontal", fraction=0.03, aspect=60,
                        label="distance to the true surface, % of its diagonal (mean in the titles)")
        figure.savefig(path, dpi=80)
        pyplot.close(figure)
        Image.open(path).convert("P", palette=Image.Palette.ADAPTIVE, colors=200).save(path, optimize=True)


class _Grid:
    """The pixels of a panel; the last axis points to the viewer."""

    def __init__(self, low, high):
        self.low, self.scale = low, SIZE / (high - low)[:2].max()
        self.width, self.height = (np.ceil((high - low)[:2] * self.scale)).astype(int)

    def draw(self, points, colours):
        column, row = ((points[:, :2] - self.low[:2]) * self.scale).astype(int).T
        kept = (column >= 0) & (column < self.width) & (row >= 0) & (row < self.height)
        pixel = (self.height - 1 - row[kept]) * self.width + column[kept]
        order = np.argsort(points[kept, 2])  # by depth, so that the point nearest to the viewer is written last
        picture = np.ones((self.height * self.width, 3))
        picture[pixel[order]] = colours[kept][order]
        return picture.reshape(self.height, self.width, 3)


def _axes(vertices):
    """Rows: the longest extent to the right, the next one up, rotated a little to show depth."""
    axes = np.linalg.svd(np.cov((vertices - vertices.mean(0)).T))[2]
    axes[2] = np.cross(axes[0], axes[1])
    turn = np.deg2rad(25)
    about_up = np.array([[np.cos(turn), 0, np.sin(turn)], [0, 1, 0], [-np.sin(turn), 0, np.cos(turn)]])
    return about_up @ axes


def _sampled(vertices, triangles, count):
    """Points, uniform by area, and the unit normals of their triangles."""
    a, b, c = (vertices[triangles[:, n]] for n in range(3))
    normals = np.cross(b - a, c - a)
    areas = np.linalg.norm(normals, axis=1)
    random = np.random.default_rng(1)
    which = random.choice(len(triangles), count, p=areas / areas.sum())
    u, v = random.random((2, count, 1))
    turned = u + v > 1
    u, v = np.where(turned, 1 - u, u), np.where(turned, 1 - v, v)
    return a[which] + u * (b - a)[which] + v * (c - a)[which], normals[which] / areas[which, None]
