// The image of a page: slices are decoded into one array of bytes, which can be sliced along any axis.
import {ImageSpace} from '../space.js';

const FULL = 257;  // factor that maps 8-bit values to 16 bits: 255 to 65535

export class Volume extends ImageSpace {
  /** `image` is the page's image, `base` the position in the world that its coordinates are relative to. */
  constructor(image, base) {
    super(image, base);
    Object.assign(this, {first: image.first, step: image.step, ofSize: image.of_size, jpegs: image.slices});
    this.data = new Uint8Array(this.size[0] * this.size[1] * this.size[2]);
    this.decoded = new Uint8Array(this.size[2]);
  }

  toFileIndex(axis, at) { return this.first[axis] + this.offset(axis) + at * this.step[axis]; }

  offset(axis) { return axis === 2 ? Math.floor(this.step[2] / 2) : 0.5 * (this.step[axis] - 1); }

  fileNumber(axis, at) { return Math.round(this.toFileIndex(axis, at)); }

  fileCount(axis) { return this.ofSize[axis]; }

  async decodeSlice(k) {
    if (this.decoded[k]) return;
    const picture = new Image();
    picture.src = `data:image/jpeg;base64,${this.jpegs[k]}`;
    await picture.decode();
    const [width, height] = this.size;
    this.canvas ??= Object.assign(document.createElement('canvas'), {width, height});
    this.context ??= this.canvas.getContext('2d', {willReadFrequently: true});
    this.context.drawImage(picture, 0, 0);
    const rgba = this.context.getImageData(0, 0, width, height).data, begin = k * width * height;
    for (let n = 0; n < width * height; ++n) this.data[begin + n] = rgba[4 * n];
    this.decoded[k] = 1;
    this.jpegs[k] = null;
  }

  /** Decodes all slices, always next the one nearest to the position that `wanted()` returns. `tell` is called repeatedly. */
  async decodeAll(wanted, tell) {
    const left = Array.from({length: this.size[2]}, (_, k) => k).filter((k) => !this.decoded[k]);
    let last = performance.now();
    while (left.length > 0) {
      const near = wanted(), nearest = left.reduce((best, k, n) => Math.abs(k - near) < Math.abs(left[best] - near) ? n : best, 0);
      await this.decodeSlice(left.splice(nearest, 1)[0]);
      if (performance.now() - last < 120) continue;
      tell();
      await new Promise((next) => setTimeout(next));
      last = performance.now();
    }
    tell();
  }

  /** The grey values of a slice, 0 to 65535, row by row. */
  slice(axis, at) {
    const [right, down] = this.planeAxes(axis), [nx, ny] = this.size, strides = [1, nx, nx * ny];
    const width = this.size[right], height = this.size[down], values = new Uint16Array(width * height), begin = at * strides[axis];
    for (let y = 0, n = 0; y < height; ++y)
      for (let x = 0, from = begin + y * strides[down]; x < width; ++x, from += strides[right]) values[n++] = FULL * this.data[from];
    return {axis, at, step: 1, width, height, values};
  }
}

/** The slices for the planes, with the interface of SliceStore. They need not be requested: decodeAll() decodes all slices. */
export class VolumeSlices {
  constructor(volume) { Object.assign(this, {volume, kept: [null, null, null]}); }

  want() {}

  hasFailed() { return false; }

  partFor() { return null; }

  late() { return null; }

  best(axis, at) {
    if (axis === 2 && !this.volume.decoded[at]) return null;
    if (this.kept[axis]?.at !== at) this.kept[axis] = this.volume.slice(axis, at);
    return this.kept[axis];
  }

  /** Called when more of the image has been decoded. */
  forget() { this.kept = [null, null, null]; }

  /** The value of a voxel. It is never exact: JPEGs of 8 bits reproduce values to within some percent. */
  valueAt([i, j, k], {low, high}) {
    const {volume} = this, [nx, ny] = volume.size;
    return volume.decoded[k] ? {value: low + volume.data[(k * ny + j) * nx + i] / 255 * (high - low), isExact: false} : null;
  }
}

/** For a page without an image: a lattice around the surfaces, on which they can be cut. */
export function spaceAround(structures, base) {
  const low = [0, 1, 2].map((a) => Math.min(...structures.map(({mesh}) => mesh.min[a]))), high = [0, 1, 2].map((a) => Math.max(...structures.map(({mesh}) => mesh.max[a])));
  const size = [201, 201, 201], spacing = low.map((x, a) => (high[a] - x) / (size[a] - 1) || 1);
  return new ImageSpace({size, spacing, origin: low, direction: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}, base);
}
