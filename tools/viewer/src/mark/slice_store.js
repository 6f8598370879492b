// Slices of the image from the server: a cache of the last ones, which also fetches the next ones ahead, and cancels
// requests for slices that are not needed any more.

const MAX_SLICES = 200, MAX_BYTES = 48 * 2 ** 20, MAX_CONCURRENT = 4, AHEAD = 6;
const MAX_STEP = 1024;
const BUSY = 503, PAUSE = 200;  // HTTP status of a busy server; ms before the request is repeated
const SLOW = 400;  // ms: if slices take longer than this, none are fetched ahead
const MAX_LATE_DISTANCE = 12;  // slices: maximum distance from the requested slice at which another one is shown until it arrives
const MAX_PIXELS = 1.5 * 2 ** 20, OVERVIEW = 2 ** 19, GRID = 256;

const partKey = (part) => part ? ` ${part.x} ${part.y} ${part.width} ${part.height}` : '';

/** The part of a slice between two voxels, enlarged to whole squares of pixels; null, for the whole slice, if it has at most MAX_PIXELS. */
function partOf([across, rows], step, [x0, y0], [x1, y1]) {
  const width = Math.ceil(across / step), height = Math.ceil(rows / step);
  if (width * height <= MAX_PIXELS) return null;
  const span = (a, b, most) => {
    const first = Math.max(0, Math.floor(Math.min(a, b) / step / GRID) * GRID), last = Math.min(most, Math.ceil((Math.max(a, b) / step + 1) / GRID) * GRID);
    return first < last ? [first, last - first] : [0, Math.min(most, GRID)];
  };
  const [x, wide] = span(x0, x1, width), [y, high] = span(y0, y1, height);
  return {x, y, width: wide, height: high};
}

export class SliceStore {
  /** `image` is the server's description; `arrived` is called for each slice that was received, or that failed. */
  constructor(space, image, arrived) {
    Object.assign(this, {space, image, arrived, slices: new Map(), bytes: 0, wanted: [[], [], []], ahead: [], underWay: new Map(), failed: new Set(), took: [0, 0, 0], mixed: [], generation: 0});
  }

  /** The part to fetch of a slice that is displayed between two voxels; null: the whole slice. */
  partFor(axis, step, from, to) { return partOf(this.space.planeAxes(axis).map((a) => this.space.size[a]), step, from, to); }

  /** The number of voxels that a slice represents: at coarse levels, several positions have the same slice. */
  thickness(axis, step) {
    const level = (this.image.levels ?? []).filter((factors) => factors.every((f) => step % f === 0)).pop();
    return level?.[axis] ?? 1;
  }

  key({axis, at, step, part = null}) {
    const thick = this.thickness(axis, step);
    return `${axis} ${Math.floor(at / thick)} ${step}${partKey(part)}`;
  }

  /** The slice, if it is cached. */
  get(axis, at, step, part = null) {
    const key = this.key({axis, at, step, part}), slice = this.slices.get(key);
    if (!slice) return null;
    this.slices.delete(key);  // a Map keeps the order of insertion: the last one is the one used last
    this.slices.set(key, slice);
    return slice;
  }

  /** The cached whole slice with this step, otherwise the cached one with the smallest step; null if there is none. */
  best(axis, at, step) {
    const own = this.get(axis, at, step);
    if (own) return own;
    for (let other = 1; other <= MAX_STEP; other *= 2) {
      const found = other === step ? null : this.get(axis, at, other);
      if (found) return found;
    }
    return null;
  }

  /** The position of the cached slice that is nearest to the requested one, if it is nearer than the displayed one; or null. */
  late(axis, at, step, shownAt) {
    const limit = Math.min(MAX_LATE_DISTANCE * this.thickness(axis, step), Math.abs(shownAt - at) - 1), towards = Math.sign(shownAt - at);
    for (let n = 1; n <= limit; ++n) if (this.slices.has(this.key({axis, at: at + n * towards, step}))) return at + n * towards;
    return null;
  }

  /** The cached part `part` of a slice, otherwise a cached part that overlaps with it, or null. */
  partial(axis, at, step, part) {
    const own = this.get(axis, at, step, part);
    if (own) return own;
    const before = this.key({axis, at, step}) + ' ', overlaps = ({part: p}) => p && p.x < part.x + part.width && part.x < p.x + p.width && p.y < part.y + part.height && part.y < p.y + p.height;
    let found = null;
    for (const [key, slice] of this.slices) if (key.startsWith(before) && overlaps(slice)) found = slice;
    return found;
  }

  hasFailed(axis, at, step, part = null) { return this.failed.has(this.key({axis, at, step, part})); }

  /** A step at which the slice has few pixels, so that it arrives soon and can be displayed until the requested slice has been received. */
  coarse(axis, step, most = OVERVIEW) {
    const [right, down] = this.space.planeAxes(axis), {size} = this.space;
    let coarse = step * 2;
    while (coarse < MAX_STEP && Math.ceil(size[right] / coarse) * Math.ceil(size[down] / coarse) > most) coarse *= 2;
    return coarse;
  }

  /** Requests a slice or a part of it and, in the direction of travel, the next ones. */
  want(axis, at, step, direction, part = null) {
    const own = {axis, at, step, part}, list = [own];
    // If the image is in chunks, which have to be decompressed, a coarse slice is requested first, because it arrives
    // sooner. It is also requested before a part, because a part is always displayed on top of a whole slice.
    const coarse = part ? this.coarse(axis, step) : 4 * step;
    if ((part || (this.image.in_chunks && !this.has(own))) && coarse <= MAX_STEP && !this.best(axis, at, step)) list.unshift({axis, at, step: coarse, part: null});
    this.wanted[axis] = list.filter((one) => !this.has(one) && !this.failed.has(this.key(one)));
    this.ahead = this.ahead.filter((one) => one.axis !== axis);
    const thick = this.thickness(axis, step), first = Math.floor(at / thick) * thick, count = this.took[axis] > SLOW ? 0 : AHEAD;
    for (let n = 1; n <= count && direction; ++n) {
      const next = {axis, at: first + n * direction * thick, step, part};
      if (next.at >= 0 && next.at < this.space.size[axis] && !this.has(next)) this.ahead.push(next);
    }
    this.dropStale(own);
    this.work();
  }

  /** Cancels requests for slices of this axis that are far from the displayed one, or that were made for another zoom. */
  dropStale({axis, at, step, part}) {
    const near = 2 * AHEAD * this.thickness(axis, step);
    for (const [key, {of, controller}] of this.underWay) {
      if (of.axis !== axis) continue;
      const isPreview = of.step > step && !of.part, isSame = of.step === step && partKey(of.part) === partKey(part);
      if (Math.abs(of.at - at) <= near && (isSame || (isPreview && of.at === at))) continue;
      this.underWay.delete(key);
      controller.abort();
    }
  }

  has(one) {
    const key = this.key(one);
    return this.slices.has(key) || this.underWay.has(key);
  }

  /** Fetches these other channels with each slice, too; slices without them are dropped. */
  mixWith(channels) {
    if (String(channels) === String(this.mixed)) return;
    for (const {controller} of this.underWay.values()) controller.abort();
    Object.assign(this, {mixed: channels, generation: this.generation + 1, bytes: 0, ahead: [], wanted: [[], [], []]});
    for (const kept of [this.slices, this.underWay, this.failed]) kept.clear();
    this.arrived();
  }

  /** After reconnecting: failed slices may be requested again. */
  retry() {
    this.failed.clear();
    this.arrived();
  }

  work() {
    while (this.underWay.size < MAX_CONCURRENT) {
      const list = this.wanted.find((one) => one.length > 0);
      // Fetching ahead leaves one of the concurrent requests free for a slice that has to be displayed.
      if (!list && this.underWay.size >= MAX_CONCURRENT - 1) return;
      const next = list ? list.shift() : this.ahead.shift();
      if (!next) return;
      if (!this.has(next)) this.fetch(next);
    }
  }

  async fetch(one) {
    const {axis, at, step, part} = one, key = this.key(one), controller = new AbortController(), began = performance.now();
    this.underWay.set(key, {of: one, controller});
    try {
      const query = part ? `&x=${part.x}&y=${part.y}&width=${part.width}&height=${part.height}` : '';
      const get = (channel) => fetch(`/slice?axis=${axis}&at=${at}&step=${step}${query}${channel}`, {signal: controller.signal});
      const answers = await Promise.all(['', ...this.mixed.map((n) => `&channel=${n}`)].map(get)), [answer] = answers, {mixed} = this;
      if (answers.some(({status}) => status === BUSY)) return this.later(key, one, controller);
      if (!answers.every(({ok}) => ok)) throw new Error(String(answer.status));
      const [values, ...others] = (await Promise.all(answers.map((one) => one.arrayBuffer()))).map((bytes) => new Uint16Array(bytes)), width = Number(answer.headers.get('X-Width'));
      this.keep(key, {axis, at, step, part, width, height: values.length / width, values, others: new Map(others.map((one, n) => [mixed[n], one]))});
      this.failed.delete(key);
      this.took[axis] += 0.3 * (performance.now() - began - this.took[axis]);
    } catch {
      if (controller.signal.aborted) return;
      this.failed.add(key);
    }
    if (controller.signal.aborted) return;
    this.underWay.delete(key);
    this.arrived();
    this.work();
  }

  /** Repeats a request that the server refused because it was busy. */
  later(key, one, {signal}) {
    setTimeout(() => {
      if (signal.aborted) return;
      this.underWay.delete(key);
      this.fetch(one);
    }, PAUSE);
  }

  keep(key, slice) {
    this.slices.set(key, slice);
    const bytesOf = ({values, others}) => values.byteLength * (1 + others.size);
    this.bytes += bytesOf(slice);
    for (const [old, stale] of this.slices) {
      if (old === key || (this.slices.size <= MAX_SLICES && this.bytes <= MAX_BYTES)) break;
      this.slices.delete(old);
      this.bytes -= bytesOf(stale);
    }
  }

  /** The value of a voxel if a cached slice contains it: {value, isExact}, or null. */
  valueAt(index, image) {
    let best = null;
    for (const slice of this.slices.values()) {
      const {axis, at, step, part, width, height} = slice, thick = this.thickness(axis, step);
      if (Math.floor(at / thick) !== Math.floor(index[axis] / thick) || (best && best.step <= step)) continue;
      const [right, down] = this.space.planeAxes(axis), x = Math.floor(index[right] / step) - (part?.x ?? 0), y = Math.floor(index[down] / step) - (part?.y ?? 0);
      if (x >= 0 && y >= 0 && x < width && y < height) best = {step, code: slice.values[y * width + x]};
    }
    return best && {value: image.low + best.code / 65535 * (image.high - image.low), isExact: best.step === 1};
  }
}
