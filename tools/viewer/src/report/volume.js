// The image: slices are decoded into one array of bytes, and cut along any axis.

import {ImageSpace} from '../space.js';

export class Volume extends ImageSpace {
  constructor(image) {
    super(image);
    Object.assign(this, {first: image.first, step: image.step, ofSize: image.of_size, black: image.black, white: image.white, jpegs: image.slices});
    this.data = new Uint8Array(this.size[0] * this.size[1] * this.size[2]);
    this.decoded = new Uint8Array(this.size[2]);
  }

  /** From the voxels of the file to those that are shown. */
  fromFileIndex(index) {
    return index.map((at, a) => (at - this.first[a] - this.offset(a)) / this.step[a]);
  }

  toFileIndex(axis, at) { return this.first[axis] + this.offset(axis) + at * this.step[axis]; }

  offset(axis) { return axis === 2 ? Math.floor(this.step[2] / 2) : 0.5 * (this.step[axis] - 1); }

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

  /** All of them; `wanted` first, then from there outwards. `tell` hears of progress. */
  async decodeAll(wanted, tell) {
    const order = Array.from({length: this.size[2]}, (_, k) => k).sort((a, b) => Math.abs(a - wanted) - Math.abs(b - wanted));
    let last = performance.now();
    for (const k of order) {
      await this.decodeSlice(k);
      if (performance.now() - last < 120) continue;
      tell();
      await new Promise((next) => setTimeout(next));
      last = performance.now();
    }
    tell();
  }

  /** The grey values of a slice as bytes, row by row. */
  slice(axis, at) {
    const [right, down] = this.planeAxes(axis), [nx, ny] = this.size;
    const strides = [1, nx, nx * ny], width = this.size[right], height = this.size[down];
    const out = new Uint8Array(width * height), begin = Math.min(this.size[axis] - 1, Math.max(0, Math.round(at))) * strides[axis];
    if (axis === 2) return out.set(this.data.subarray(begin, begin + width * height)), {width, height, values: out};
    for (let y = 0, n = 0; y < height; ++y)
      for (let x = 0, from = begin + y * strides[down]; x < width; ++x, from += strides[right]) out[n++] = this.data[from];
    return {width, height, values: out};
  }
}
