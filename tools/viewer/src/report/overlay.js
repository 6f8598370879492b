// The overlay on a slice of the report page.
import {drawCrosshair, drawMarks, drawRing, drawRuler, drawSurface} from '../overlay.js';

export function drawOverlay(panel, context) {
  const active = panel.tools.active(), ordered = [...panel.study.structures].sort((a, b) => (a === active) - (b === active));  // the active structure is drawn last, on top
  drawCrosshair(panel, context);
  for (const structure of ordered) if (structure.visible) drawSurface(panel, context, structure, structure === active);
  drawMarks(panel, context);
  drawRuler(panel, context);
  drawRing(panel, context);
}
