// Where voxels lie: from an image's indices to the world and back, and what its planes are called.

export const AXIS_COLORS = ['#d9574a', '#4f9e57', '#4a7fd1'];
const PLANES = ['sagittal', 'coronal', 'axial'];

const ROUNDING = 1e-3;  // cosine between axes, of a file's direction
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

/** The world axis that an image axis runs along most. */
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
    /** What tells how far a place is along each axis, however the others lean: perpendicular to them. */
    this.duals = [cross(j, k), cross(k, i), cross(i, j)].map((dual) => dual.map((v) => v / volume));
  }

  toWorld(index) {
    return [0, 1, 2].map((w) => this.origin[w] + this.axes.reduce((sum, axis, a) => sum + axis[w] * index[a] * this.spacing[a], 0));
  }

  toIndex(world) {
    const from = world.map((x, w) => x - this.origin[w]);
    return this.duals.map((dual, a) => dot(dual, from) / this.spacing[a]);
  }

  /** The cosine between two axes; 0 where they are perpendicular. */
  cosine(a, b) { return this.cosines[a][b]; }

  /** The scalar product of two vectors that are given as lengths along the axes. */
  product(u, v) {
    const own = dot(u, v), [, [c10], [c20, c21]] = this.cosines;
    return this.isSheared ? own + c10 * (u[0] * v[1] + u[1] * v[0]) + c20 * (u[0] * v[2] + u[2] * v[0]) + c21 * (u[1] * v[2] + u[2] * v[1]) : own;
  }

  /** The number of a slice as covol's files count it, from 0, and how many there are. */
  fileNumber(axis, at) { return at; }

  fileCount(axis) { return this.size[axis]; }

  /** The place in the world that a file would name: pages of places far from 0 count from a place near them. */
  fileWorld(index) { return this.toWorld(index).map((x, w) => x + this.base[w]); }

  /** The voxel at an index, or the nearest one of the image. */
  voxelAt(index) { return index.map((at, a) => Math.min(this.size[a] - 1, Math.max(0, Math.round(at)))); }

  /** The axes that a slice along `axis` shows: to the right, and along the other one. */
  planeAxes(axis) { return [[1, 2], [0, 2], [0, 1]][axis]; }
}
