// Slices of the image as the server has them: those seen last are kept, those that come next are fetched before.

const MOST_SLICES = 200, MOST_BYTES = 256 * 2 ** 20, MOST_AT_ONCE = 4, AHEAD = 6;

export class SliceStore {
  /** `arrived` is called for each slice that came, or that did not. */
  constructor(space, arrived) {
    Object.assign(this, {space, arrived, slices: new Map(), bytes: 0, wanted: [null, null, null], ahead: [], underWay: new Set(), failed: new Set()});
  }

  static key(axis, at, step) { return `${axis} ${at} ${step}`; }

  /** The slice, if it is here. */
  get(axis, at, step) {
    const key = SliceStore.key(axis, at, step), slice = this.slices.get(key);
    if (!slice) return null;
    this.slices.delete(key);  // the last of the map is the one that was used last
    this.slices.set(key, slice);
    return slice;
  }

  /** The slice, or the finest that is here; null where there is none. */
  best(axis, at, step) {
    const own = this.get(axis, at, step);
    if (own) return own;
    for (let other = 1; other <= 64; other *= 2) {
      const found = other === step ? null : this.get(axis, at, other);
      if (found) return found;
    }
    return null;
  }

  hasFailed(axis, at, step) { return this.failed.has(SliceStore.key(axis, at, step)); }

  /** Asks for a slice and, in the direction of travel, for those after it. */
  want(axis, at, step, direction) {
    this.wanted[axis] = this.has(axis, at, step) || this.hasFailed(axis, at, step) ? null : {axis, at, step};
    this.ahead = this.ahead.filter((one) => one.axis !== axis);
    for (let n = 1; n <= AHEAD && direction; ++n) {
      const next = at + n * direction;
      if (next >= 0 && next < this.space.size[axis] && !this.has(axis, next, step)) this.ahead.push({axis, at: next, step});
    }
    this.work();
  }

  has(axis, at, step) {
    const key = SliceStore.key(axis, at, step);
    return this.slices.has(key) || this.underWay.has(key);
  }

  /** The connection is back: what failed may be asked for again. */
  retry() {
    this.failed.clear();
    this.arrived();
  }

  work() {
    while (this.underWay.size < MOST_AT_ONCE) {
      const axis = this.wanted.findIndex(Boolean);
      // One way stays free for what is looked at next.
      if (axis < 0 && this.underWay.size >= MOST_AT_ONCE - 1) return;
      const next = axis >= 0 ? this.wanted[axis] : this.ahead.shift();
      if (!next) return;
      if (axis >= 0) this.wanted[axis] = null;
      if (!this.has(next.axis, next.at, next.step)) this.fetch(next);
    }
  }

  async fetch({axis, at, step}) {
    const key = SliceStore.key(axis, at, step);
    this.underWay.add(key);
    try {
      const answer = await fetch(`/slice?axis=${axis}&at=${at}&step=${step}`);
      if (!answer.ok) throw new Error(String(answer.status));
      const values = new Uint16Array(await answer.arrayBuffer()), width = Number(answer.headers.get('X-Width'));
      this.keep(key, {axis, at, step, width, height: values.length / width, values});
      this.failed.delete(key);
    } catch {
      this.failed.add(key);
    }
    this.underWay.delete(key);
    this.arrived();
    this.work();
  }

  keep(key, slice) {
    this.slices.set(key, slice);
    this.bytes += slice.values.byteLength;
    for (const [old, {values}] of this.slices) {
      if (old === key || (this.slices.size <= MOST_SLICES && this.bytes <= MOST_BYTES)) break;
      this.slices.delete(old);
      this.bytes -= values.byteLength;
    }
  }

  /** The value of a voxel where a slice holds it: {value, isExact}, or null. */
  valueAt(index, image) {
    for (const axis of [2, 1, 0]) {
      const slice = this.slices.get(SliceStore.key(axis, index[axis], 1)) ?? null;
      if (slice) return {value: this.decode(slice, index, image), isExact: true};
    }
    for (const axis of [2, 1, 0])
      for (let step = 2; step <= 64; step *= 2) {
        const slice = this.slices.get(SliceStore.key(axis, index[axis], step));
        if (slice) return {value: this.decode(slice, index, image), isExact: false};
      }
    return null;
  }

  decode({axis, step, width, values}, index, {low, high}) {
    const [right, down] = this.space.planeAxes(axis);
    return low + values[Math.floor(index[down] / step) * width + Math.floor(index[right] / step)] / 65535 * (high - low);
  }
}
