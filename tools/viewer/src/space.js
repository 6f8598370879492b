// Where voxels lie: from an image's indices to the world and back, and what its planes are called.

export const AXIS_COLORS = ['#d9574a', '#4f9e57', '#4a7fd1'];
const PLANES = ['sagittal', 'coronal', 'axial'];

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

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
  }

  toWorld(index) {
    return [0, 1, 2].map((w) => this.origin[w] + this.axes.reduce((sum, axis, a) => sum + axis[w] * index[a] * this.spacing[a], 0));
  }

  toIndex(world) {
    const from = world.map((x, w) => x - this.origin[w]);
    return this.axes.map((axis, a) => dot(axis, from) / this.spacing[a]);
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
