// Positions of voxels: from an image's indices to the world and back, and the names of its planes.

export const AXIS_COLORS = ['#d9574a', '#4f9e57', '#4a7fd1'];
const PLANES = ['sagittal', 'coronal', 'axial'];

const ROUNDING = 1e-3;  // cosines between axes up to this are treated as rounding errors of files
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

/** The world axis that is closest to an image axis. */
export function dominant(axis) {
  const sizes = axis.map(Math.abs), w = sizes.indexOf(Math.max(...sizes));
  return {w, sign: Math.sign(axis[w]) || 1};
}

export function planeName(space, axis, anatomical) {
  return anatomical ? PLANES[dominant(space.axes[axis]).w] : ['yz', 'xz', 'xy'][axis];
}

/** An image's lattice; voxel centres are at integers. */
export class ImageSpace {
  constructor({size, spacing, origin, direction}, base = [0, 0, 0]) {
    Object.assign(this, {size, spacing, origin, base});
    // Columns of the direction are the axes i, j, k.
    this.axes = [0, 1, 2].map((a) => [0, 1, 2].map((row) => direction[row][a]));
    const [i, j, k] = this.axes, volume = dot(cross(i, j), k);
    const cosine = (a, b) => (a === b || Math.abs(dot(this.axes[a], this.axes[b])) <= ROUNDING ? 0 : dot(this.axes[a], this.axes[b]));
    this.cosines = [0, 1, 2].map((a) => [0, 1, 2].map((b) => cosine(a, b)));
    this.isSheared = this.cosines.flat().some((c) => c !== 0);
    /** Dual vectors, perpendicular to the other axes: they give the coordinate along each axis, even if the image is sheared. */
    this.duals = [cross(j, k), cross(k, i), cross(i, j)].map((dual) => dual.map((v) => v / volume));
  }

  toWorld(index) {
    return [0, 1, 2].map((w) => this.origin[w] + this.axes.reduce((sum, axis, a) => sum + axis[w] * index[a] * this.spacing[a], 0));
  }

  toIndex(world) {
    const from = world.map((x, w) => x - this.origin[w]);
    return this.duals.map((dual, a) => dot(dual, from) / this.spacing[a]);
  }

  /** The cosine between two axes; 0 if they are orthogonal. */
  cosine(a, b) { return this.cosines[a][b]; }

  /** The scalar product of two vectors given by lengths along the axes. */
  product(u, v) {
    const own = dot(u, v), [, [c10], [c20, c21]] = this.cosines;
    return this.isSheared ? own + c10 * (u[0] * v[1] + u[1] * v[0]) + c20 * (u[0] * v[2] + u[2] * v[0]) + c21 * (u[1] * v[2] + u[2] * v[1]) : own;
  }

  /** The number of a slice in files of covol, from 0, and the number of slices. */
  fileNumber(axis, at) { return at; }

  fileCount(axis) { return this.size[axis]; }

  /** The world position as written to files: on pages, positions are relative to `base`, which avoids large numbers. */
  fileWorld(index) { return this.toWorld(index).map((x, w) => x + this.base[w]); }

  /** The voxel at an index, clamped to the image. */
  voxelAt(index) { return index.map((at, a) => Math.min(this.size[a] - 1, Math.max(0, Math.round(at)))); }

  /** The axes of a slice along `axis`: to the right, and downwards. */
  planeAxes(axis) { return [[1, 2], [0, 2], [0, 1]][axis]; }
}
