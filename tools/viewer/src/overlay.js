// Drawn on a slice: crosshair, outlines, marks, the ruler, a suggested position.
import {colorOf, number} from './dom.js';
import {linesAt} from './outline.js';
import {write} from './plane.js';
import {AXIS_COLORS} from './space.js';

export const FAINT_WITHIN = 2;  // slices: maximum distance at which marks of other slices are drawn, faintly
const GAP = 9;  // pixels around the crosshair's centre that stay free
const indices = new WeakMap();

/** A mark's position in voxels. */
export function indexOf(space, mark) {
  let index = indices.get(mark);
  if (!index) indices.set(mark, index = space.toIndex(mark.world));
  return index;
}

/** A structure's colour on a grey image: dark colours are brightened, first at constant hue, then towards white. */
export function inkOf(rgb) {
  const light = ([r, g, b]) => (0.299 * r + 0.587 * g + 0.114 * b) / 255, grow = Math.min(255 / Math.max(1, ...rgb), Math.max(1, 0.6 / Math.max(0.01, light(rgb))));
  const bright = rgb.map((v) => v * grow), share = Math.max(0, (0.5 - light(bright)) / (1 - light(bright)));
  return colorOf(bright.map((v) => Math.round(v + share * (255 - v))));
}

/** The distance in whole slices between a mark or an outline and the displayed slice. */
export const away = (at, shown) => Math.max(0, Math.ceil(Math.abs(at - shown) - 0.5 - 1e-6));

/** Draws lines, given by voxel coordinates, with a dark rim, which makes them visible on white, too. */
export function stroke(context, panel, lines, color, {width = 1.6, rim = 1.8, dash = [], alpha = 1} = {}) {
  context.beginPath();
  for (const {places, closed} of lines) {
    for (let n = 0; n < places.length; n += 2) {
      const spot = panel.plane.place(places[n], places[n + 1]);
      if (n === 0) context.moveTo(...spot); else context.lineTo(...spot);
    }
    if (closed) context.closePath();
  }
  context.lineJoin = context.lineCap = 'round';
  context.setLineDash(dash);
  context.globalAlpha = alpha;
  for (const [style, more] of [['rgba(0, 0, 0, 0.5)', rim], [color, 0]]) {
    context.strokeStyle = style;
    context.lineWidth = width + more;
    context.stroke();
  }
  context.setLineDash([]);
  context.globalAlpha = 1;
}

export function drawCrosshair(panel, context) {
  const {plane, state, axis} = panel, slices = state.get('slices'), [x, y] = plane.place(slices[plane.right], slices[plane.down]), {left, top, width, height} = plane;
  if (slices[axis] !== panel.shownAt) return;
  context.lineWidth = 1;
  context.globalAlpha = 0.6;
  // If the image is sheared, columns of voxels are inclined on the screen, and so is the vertical line of the
  // crosshair.
  const slope = plane.lean / plane.scaleY, from = left + (y - top) * slope, on = (row) => x + (row - y) * slope;
  const parts = [[plane.right, on(top), top, on(y - GAP), y - GAP], [plane.right, on(y + GAP), y + GAP, on(top + height), top + height],
    [plane.down, from, y, x - GAP, y], [plane.down, x + GAP, y, from + width, y]];
  for (const [of, x0, y0, x1, y1] of parts) {
    if ((of === plane.down && x1 < x0) || y1 < y0) continue;
    context.strokeStyle = AXIS_COLORS[of];
    context.beginPath();
    context.moveTo(x0, y0);
    context.lineTo(x1, y1);
    context.stroke();
  }
  context.globalAlpha = 1;
}

export function drawSurface(panel, context, structure, isActive) {
  const {meshes, axis, shownAt: at, right, down} = panel, mesh = meshes.get(structure.id);
  if (!mesh) return;
  const color = inkOf(structure.color);
  if (mesh.before) stroke(context, panel, linesAt(mesh.before, axis, at, [right, down]), color, {width: 1.2, rim: 0.8, dash: [4, 4]});
  stroke(context, panel, linesAt(mesh, axis, at, [right, down]), color, {width: isActive ? 1.9 : 1.4, alpha: isActive ? 1 : 0.85});
  if (!mesh.isShown) {
    mesh.isShown = true;
    panel.onShown?.(mesh);
  }
}

/** Draws a mark: a disc for a mark on the surface, a disc with a plus for inside, a ring with a minus for outside. */
export function drawMark(context, [x, y], kind, color, {radius = 4, alpha = 1, isMeant = false} = {}) {
  const size = isMeant ? radius + 1.5 : radius;
  context.globalAlpha = alpha;
  context.beginPath();
  context.arc(x, y, size + 1.2, 0, 2 * Math.PI);
  context.fillStyle = 'rgba(0, 0, 0, 0.85)';
  context.fill();
  context.beginPath();
  context.arc(x, y, kind === 'outside' ? size - 0.6 : size, 0, 2 * Math.PI);
  if (kind === 'outside') {
    context.strokeStyle = color;
    context.lineWidth = 1.6;
    context.stroke();
  } else {
    context.fillStyle = color;
    context.fill();
  }
  if (kind !== 'surface') {
    context.strokeStyle = '#fff';
    context.lineWidth = 1.5;
    context.lineCap = 'butt';
    context.beginPath();
    context.moveTo(x - size * 0.55, y);
    context.lineTo(x + size * 0.55, y);
    if (kind === 'inside') {
      context.moveTo(x, y - size * 0.55);
      context.lineTo(x, y + size * 0.55);
    }
    context.stroke();
  }
  if (isMeant) {
    context.strokeStyle = '#fff';
    context.lineWidth = 1.5;
    context.beginPath();
    context.arc(x, y, size + 2.4, 0, 2 * Math.PI);
    context.stroke();
  }
  context.globalAlpha = 1;
}

/** Marks displayed on a panel: [{structure, mark, spot, far}]; dragged ones have their new position. */
export function marksOn(panel, most = FAINT_WITHIN) {
  const {study, space, state, axis, plane} = panel, drag = state.get('drag'), list = [];
  if (!state.get('marks')) return list;
  for (const structure of study.structures) {
    if (!structure.visible) continue;
    for (const mark of structure.marks) {
      const index = drag && drag.mark === mark.id && drag.structure === structure.id ? space.toIndex(drag.world) : indexOf(space, mark), far = away(index[axis], panel.shownAt);
      if (far <= most) list.push({structure, mark, far, spot: plane.place(index[plane.right], index[plane.down])});
    }
  }
  return list;
}

export function drawMarks(panel, context) {
  const selected = panel.state.get('selected'), hover = panel.state.get('hover'), list = marksOn(panel);
  const many = list.length > 300;  // then they are drawn smaller, because they would hide the outline
  for (const {structure, mark, far, spot} of list.sort((a, b) => b.far - a.far)) {
    const isMeant = [selected, hover].some((t) => t?.mark === mark.id && t.structure === structure.id);
    drawMark(context, spot, mark.kind, inkOf(structure.color), {radius: (far ? 3 : 4) * (many ? 0.6 : 1), alpha: far ? 0.5 - 0.15 * far : 1, isMeant});
  }
}

export function drawRing(panel, context) {
  const ring = panel.state.get('ring');
  if (!ring) return;
  const index = panel.space.toIndex(ring.world);
  if (away(index[panel.axis], panel.shownAt) > 0) return;
  const [x, y] = panel.spotOf(ring.world);
  for (const [color, width] of [['rgba(0, 0, 0, 0.65)', 4], ['#ffd24a', 2]]) {
    context.strokeStyle = color;
    context.lineWidth = width;
    context.beginPath();
    context.arc(x, y, 13, 0, 2 * Math.PI);
    context.stroke();
  }
  context.font = '600 12px system-ui, sans-serif';
  const text = 'is the border here?', half = context.measureText(text).width / 2 + 6, {viewWidth, viewHeight} = panel.plane;
  context.textAlign = 'center';
  write(context, text, Math.min(viewWidth - half, Math.max(half, x)), y + 32 > viewHeight ? y - 22 : y + 30, '#ffd24a');
}

export function drawRuler(panel, context) {
  const ruler = panel.state.get('ruler');
  if (!ruler || ruler.axis !== panel.axis || ruler.at !== panel.shownAt) return;
  const {space, right, down} = panel, places = [ruler.from[right], ruler.from[down], ruler.to[right], ruler.to[down]];
  stroke(context, panel, [{places, closed: false}], '#fff', {width: 1.4});
  const [a, b] = [space.toWorld(ruler.from), space.toWorld(ruler.to)], length = Math.hypot(...a.map((v, n) => b[n] - v));
  const from = panel.plane.place(places[0], places[1]), to = panel.plane.place(places[2], places[3]);
  for (const [x, y] of [from, to]) {
    context.fillStyle = '#fff';
    context.beginPath();
    context.arc(x, y, 2.6, 0, 2 * Math.PI);
    context.fill();
  }
  context.font = '600 12px system-ui, sans-serif';
  context.textAlign = 'center';
  write(context, `${number(length, 4)}${panel.unitText ? ` ${panel.unitText}` : ''}`, (from[0] + to[0]) / 2, (from[1] + to[1]) / 2 - 9);
}
