// Painted voxels on a slice; draws strokes like lib/src/study/paint.cpp.

const NOTHING = {};
const lengthOf = (space, along) => Math.sqrt(space.product(along, along));

/**
 * Splits the segments of a stroke into pieces of at most twice its radius. All voxels in the bounding box of a piece are tested, and
 * most voxels in the box of a long segment are not painted.
 */
function* pieces(space, corners, radius) {
  if (corners.length === 1) yield [corners[0], corners[0]];
  for (let n = 1; n < corners.length; ++n) {
    const [a, b] = [corners[n - 1], corners[n]], parts = Math.max(1, Math.ceil(lengthOf(space, a.map((v, c) => b[c] - v)) / (2 * radius)));
    const at = (part) => a.map((v, c) => v + part / parts * (b[c] - v));
    for (let part = 0; part < parts; ++part) yield [at(part), at(part + 1)];
  }
}

/** Draws a stroke on a slice: `take` is called with the column and row of each voxel. Lengths are along the image's axes. */
export function drawStroke(space, stroke, axis, at, take) {
  const isDisc = stroke.axis !== undefined && stroke.axis !== null;
  if (isDisc && stroke.axis === axis && stroke.at !== at) return;
  const {size, spacing} = space, [right, down] = space.planeAxes(axis), {radius} = stroke, most = radius * radius * (1 + 1e-9), reach = space.duals.map((dual) => (space.isSheared ? Math.hypot(...dual) : 1));
  const corners = stroke.world.map((world) => space.toIndex(world).map((v, c) => (isDisc && c === stroke.axis ? stroke.at : v) * spacing[c]));
  for (const [a, b] of pieces(space, corners, radius)) {
    const low = [0, 0, 0], high = [0, 0, 0];
    for (let c = 0; c < 3; ++c) {
      low[c] = Math.max(0, Math.ceil((Math.min(a[c], b[c]) - radius * reach[c]) / spacing[c]));
      high[c] = Math.min(size[c] - 1, Math.floor((Math.max(a[c], b[c]) + radius * reach[c]) / spacing[c]));
      if (isDisc && c === stroke.axis) low[c] = high[c] = stroke.at;
    }
    if (at < low[axis] || at > high[axis]) continue;
    const along = a.map((v, c) => b[c] - v), length2 = space.product(along, along), d = [0, 0, 0], off = [0, 0, 0];
    d[axis] = at * spacing[axis] - a[axis];
    for (let y = low[down]; y <= high[down]; ++y) {
      d[down] = y * spacing[down] - a[down];
      for (let x = low[right]; x <= high[right]; ++x) {
        d[right] = x * spacing[right] - a[right];
        const part = length2 > 0 ? Math.min(1, Math.max(0, space.product(d, along) / length2)) : 0;
        for (let c = 0; c < 3; ++c) off[c] = d[c] - part * along[c];
        if (space.product(off, off) <= most) take(x, y);
      }
    }
  }
}

function pictureOf(space, strokes, axis, at, rgb) {
  const [right, down] = space.planeAxes(axis), width = space.size[right], height = space.size[down], values = new Uint8Array(width * height);
  for (const stroke of strokes) drawStroke(space, stroke, axis, at, (x, y) => { values[y * width + x] = stroke.erases ? 0 : 1; });
  if (!values.includes(1)) return NOTHING;
  const canvas = Object.assign(document.createElement('canvas'), {width, height}), context = canvas.getContext('2d'), data = context.createImageData(width, height);
  const pixels = new Uint32Array(data.data.buffer), color = 0xff000000 | rgb[2] << 16 | rgb[1] << 8 | rgb[0];
  for (let n = 0; n < values.length; ++n) if (values[n]) pixels[n] = color;
  context.putImageData(data, 0, 0);
  return {canvas};
}

/** Caches the pictures of displayed slices. A finished stroke never changes, so the number of strokes and the last one identify the picture. */
export class PaintPictures {
  constructor(space) { Object.assign(this, {space, kept: new Map()}); }

  /** A canvas with one pixel per voxel of the slice; null if nothing is painted on it. */
  get(structure, axis, at) {
    const name = `${structure.id} ${axis}`, known = this.kept.get(name), {strokes = []} = structure, last = strokes.at(-1);
    if (strokes.length === 0) return null;
    const key = `${at} ${strokes.length} ${last.id} ${structure.color}`;
    if (known?.key === key) return known.picture.canvas ?? null;
    const picture = pictureOf(this.space, strokes, axis, at, structure.color);
    this.kept.set(name, {key, picture});
    return picture.canvas ?? null;
  }

  /** The picture of an unfinished stroke. */
  draft(stroke, axis, at, rgb) { return pictureOf(this.space, [{...stroke, erases: false}], axis, at, rgb).canvas ?? null; }
}
