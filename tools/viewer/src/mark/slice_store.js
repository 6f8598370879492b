// Slices of the image as the server has them: those seen last are kept, those that come next are fetched before, and what
// is not looked at any more is not waited for.

const MOST_SLICES = 200, MOST_BYTES = 48 * 2 ** 20, MOST_AT_ONCE = 4, AHEAD = 6;
const MOST_STEP = 1024;
const BUSY = 503, PAUSE = 200;  // ms
const SLOW = 400;  // ms: slices that take longer are not fetched before
const MOST_LATE = 12;  // slices that one which comes late may lie beside the one that is wanted
const MOST_PIXELS = 1.5 * 2 ** 20, OVERVIEW = 2 ** 19, GRID = 256;

const partKey = (part) => part ? ` ${part.x} ${part.y} ${part.width} ${part.height}` : '';

/** The part of a slice of so many voxels that is seen between two of them, in whole squares; null where the slice is small. */
function partOf([across, rows], step, [x0, y0], [x1, y1]) {
  const width = Math.ceil(across / step), height = Math.ceil(rows / step);
  if (width * height <= MOST_PIXELS) return null;
  const span = (a, b, most) => {
    const first = Math.max(0, Math.floor(Math.min(a, b) / step / GRID) * GRID), last = Math.min(most, Math.ceil((Math.max(a, b) / step + 1) / GRID) * GRID);
    return first < last ? [first, last - first] : [0, Math.min(most, GRID)];
  };
  const [x, wide] = span(x0, x1, width), [y, high] = span(y0, y1, height);
  return {x, y, width: wide, height: high};
}

export class SliceStore {
  /** `image` is what the server says of it; `arrived` is called for each slice that came, or that did not. */
  constructor(space, image, arrived) {
    Object.assign(this, {space, image, arrived, slices: new Map(), bytes: 0, wanted: [[], [], []], ahead: [], underWay: new Map(), failed: new Set(), took: [0, 0, 0], mixed: [], generation: 0});
  }

  /** What is to be fetched of a slice, of which the part between two voxels is seen; null: all of it. */
  partFor(axis, step, from, to) { return partOf(this.space.planeAxes(axis).map((a) => this.space.size[a]), step, from, to); }

  /** The voxels that a slice stands for: of a coarse level several have the same one. */
  thickness(axis, step) {
    const level = (this.image.levels ?? []).filter((factors) => factors.every((f) => step % f === 0)).pop();
    return level?.[axis] ?? 1;
  }

  key({axis, at, step, part = null}) {
    const thick = this.thickness(axis, step);
    return `${axis} ${Math.floor(at / thick)} ${step}${partKey(part)}`;
  }

  /** The slice, if it is here. */
  get(axis, at, step, part = null) {
    const key = this.key({axis, at, step, part}), slice = this.slices.get(key);
    if (!slice) return null;
    this.slices.delete(key);  // the last of the map is the one that was used last
    this.slices.set(key, slice);
    return slice;
  }

  /** The whole slice, or the finest that is here; null where there is none. */
  best(axis, at, step) {
    const own = this.get(axis, at, step);
    if (own) return own;
    for (let other = 1; other <= MOST_STEP; other *= 2) {
      const found = other === step ? null : this.get(axis, at, other);
      if (found) return found;
    }
    return null;
  }

  /** The place of the slice that came last and lies nearer to the wanted one than the one that is shown; or null. */
  late(axis, at, step, shownAt) {
    const limit = Math.min(MOST_LATE * this.thickness(axis, step), Math.abs(shownAt - at) - 1), towards = Math.sign(shownAt - at);
    for (let n = 1; n <= limit; ++n) if (this.slices.has(this.key({axis, at: at + n * towards, step}))) return at + n * towards;
    return null;
  }

  /** A part of that slice that overlaps with this one. */
  partial(axis, at, step, part) {
    const own = this.get(axis, at, step, part);
    if (own) return own;
    const before = this.key({axis, at, step}) + ' ', overlaps = ({part: p}) => p && p.x < part.x + part.width && part.x < p.x + p.width && p.y < part.y + part.height && part.y < p.y + p.height;
    let found = null;
    for (const [key, slice] of this.slices) if (key.startsWith(before) && overlaps(slice)) found = slice;
    return found;
  }

  hasFailed(axis, at, step, part = null) { return this.failed.has(this.key({axis, at, step, part})); }

  /** The step at which a slice is small: what is shown until the rest is there. */
  coarse(axis, step, most = OVERVIEW) {
    const [right, down] = this.space.planeAxes(axis), {size} = this.space;
    let coarse = step * 2;
    while (coarse < MOST_STEP && Math.ceil(size[right] / coarse) * Math.ceil(size[down] / coarse) > most) coarse *= 2;
    return coarse;
  }

  /** Asks for a slice or a part of it and, in the direction of travel, for those after it. */
  want(axis, at, step, direction, part = null) {
    const own = {axis, at, step, part}, list = [own];
    // Of chunks that have to be unpacked a coarse level's few are there first; under a part there is always a whole.
    const coarse = part ? this.coarse(axis, step) : 4 * step;
    if ((part || (this.image.in_chunks && !this.has(own))) && coarse <= MOST_STEP && !this.best(axis, at, step)) list.unshift({axis, at, step: coarse, part: null});
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

  /** What is far from the slice that is looked at now, or of another zoom, is not waited for. */
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

  /** Slices have the values of these other channels, too; what is here without them goes. */
  mixWith(channels) {
    if (String(channels) === String(this.mixed)) return;
    for (const {controller} of this.underWay.values()) controller.abort();
    Object.assign(this, {mixed: channels, generation: this.generation + 1, bytes: 0, ahead: [], wanted: [[], [], []]});
    for (const kept of [this.slices, this.underWay, this.failed]) kept.clear();
    this.arrived();
  }

  /** The connection is back: what failed may be asked for again. */
  retry() {
    this.failed.clear();
    this.arrived();
  }

  work() {
    while (this.underWay.size < MOST_AT_ONCE) {
      const list = this.wanted.find((one) => one.length > 0);
      // One way stays free for what is looked at next.
      if (!list && this.underWay.size >= MOST_AT_ONCE - 1) return;
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

  /** The server has too much to do: it is asked again. */
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
      if (old === key || (this.slices.size <= MOST_SLICES && this.bytes <= MOST_BYTES)) break;
      this.slices.delete(old);
      this.bytes -= bytesOf(stale);
    }
  }

  /** The value of a voxel where a slice holds it: {value, isExact}, or null. */
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
