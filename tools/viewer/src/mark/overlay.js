// What the mark page draws on a slice in addition to the parts of both pages: paint, finished and unfinished outlines.
import {away, drawCrosshair, drawMark, drawMarks, drawRing, drawRuler, drawSurface, FAINT_WITHIN, inkOf, stroke} from '../overlay.js';
import {isBrush} from './tools.js';

function planePlaces(panel, worlds) {
  return worlds.flatMap((world) => {
    const index = panel.space.toIndex(world);
    return [index[panel.right], index[panel.down]];
  });
}

function drawOutlines(panel, context, structure) {
  const selected = panel.state.get('selected'), hover = panel.state.get('hover');
  for (const outline of structure.outlines) {
    const far = away(outline.at, panel.shownAt);
    if (outline.axis !== panel.axis || far > FAINT_WITHIN) continue;
    const places = planePlaces(panel, outline.world), isMeant = [selected, hover].some((t) => t?.outline === outline.id && t.structure === structure.id);
    stroke(context, panel, [{places, closed: outline.closed}], inkOf(structure.color), {width: isMeant ? 2.6 : 1.6, dash: [1, 4], alpha: far ? 0.35 : 1});
    if (far) continue;
    for (let n = 0; n < places.length; n += 2) {
      const [x, y] = panel.plane.place(places[n], places[n + 1]);
      context.fillStyle = '#000';
      context.fillRect(x - 2.5, y - 2.5, 5, 5);
      context.fillStyle = inkOf(structure.color);
      context.fillRect(x - 1.5, y - 1.5, 3, 3);
    }
  }
}

function drawDraft(panel, context) {
  const draft = panel.state.get('draft');
  if (!draft || draft.axis !== panel.axis || draft.at !== panel.shownAt) return;
  const own = panel.tools.active() ?? panel.study.structures[0], color = own ? inkOf(own.color) : '#fff';
  stroke(context, panel, [{places: draft.places.flat(), closed: false}], color, {width: 1.8});
  const pointer = panel.input.spot, last = panel.plane.place(...draft.places[draft.places.length - 1]);
  if (pointer && !panel.input.isDrawing) {
    context.setLineDash([4, 4]);
    context.strokeStyle = 'rgba(255, 255, 255, 0.8)';
    context.lineWidth = 1.2;
    context.beginPath();
    context.moveTo(...last);
    context.lineTo(...pointer);
    context.lineTo(...panel.plane.place(...draft.places[0]));
    context.stroke();
    context.setLineDash([]);
  }
  for (const spot of [panel.plane.place(...draft.places[0]), last]) drawMark(context, spot, 'surface', color, {radius: 3});
}

function drawPaint(panel, context) {
  const {painting, axis, shownAt: at, study, state, tools} = panel, stroke = state.get('stroke');
  if (at < 0) return;
  const draw = (canvas, alpha) => {
    if (!canvas) return;
    context.globalAlpha = alpha;
    panel.plane.drawPicture(context, canvas);
    context.globalAlpha = 1;
  };
  for (const structure of study.structures) if (structure.visible) draw(painting.get(structure, axis, at), 0.38);
  if (stroke) draw(painting.draft(stroke, axis, at, stroke.erases ? [255, 255, 255] : tools.active()?.color ?? [255, 210, 74]), stroke.erases ? 0.3 : 0.45);
}

/** Shows the size of the brush at the pointer. */
function drawBrush(panel, context) {
  const {state, input, plane} = panel;
  if (!isBrush(state.get('tool')) || !input.spot) return;
  context.beginPath();
  context.arc(...input.spot, Math.max(2, state.get('brush').radius * plane.scale), 0, 2 * Math.PI);
  for (const [color, width] of [['rgba(0, 0, 0, 0.6)', 3], ['#fff', 1.2]]) {
    context.strokeStyle = color;
    context.lineWidth = width;
    context.stroke();
  }
}

export function drawOverlay(panel, context) {
  drawPaint(panel, context);
  drawCrosshair(panel, context);
  const active = panel.tools.active();
  const ordered = [...panel.study.structures].sort((a, b) => (a === active) - (b === active));  // the active structure is drawn last, on top
  for (const structure of ordered)
    if (structure.visible) {
      drawSurface(panel, context, structure, structure === active);
      drawOutlines(panel, context, structure);
    }
  drawMarks(panel, context);
  drawDraft(panel, context);
  drawRuler(panel, context);
  drawRing(panel, context);
  drawBrush(panel, context);
}
