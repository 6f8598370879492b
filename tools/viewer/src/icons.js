// Icons, drawn as lines in a box of 18 x 18 units of their SVG.
import {svg} from './dom.js';

const PATHS = {
  surface: ['M1.8 13.2C4 5.5 14 5.5 16.2 13.2', ['circle', 9, 7.4, 2.4]],
  inside: ['M9 2.6a6.4 6.4 0 1 1 0 12.8A6.4 6.4 0 0 1 9 2.6', ['circle', 9, 9, 2.2]],
  outside: ['M7.4 5.2a5.2 5.2 0 1 1 0 10.4 5.2 5.2 0 0 1 0-10.4', ['circle', 14.2, 4, 2.2]],
  outline: ['M3.4 12.6 5.2 4.4 13.4 3.2 15 11 9.4 15z', ['dot', 3.4, 12.6], ['dot', 5.2, 4.4], ['dot', 13.4, 3.2], ['dot', 15, 11], ['dot', 9.4, 15]],
  erase: ['M6.7 14.9 2.9 11a1.3 1.3 0 0 1 0-1.8l6.2-6.2a1.3 1.3 0 0 1 1.8 0l4.2 4.2a1.3 1.3 0 0 1 0 1.8l-5.9 5.9zM6 6.1l6 6M6.7 14.9h8.6'],
  brush: ['M8.4 10.6 14.6 3a1 1 0 0 1 1.5 1.4L9.6 11.8M8.4 10.6c-1.7-.5-3.3.4-3.6 2-.2 1.2-.9 1.8-2.4 2 1.6 1.4 5.3 1.4 6.6-.4.9-1.2.6-2.1.6-2.4z'],
  rubber: ['M8.4 10.6 14.6 3a1 1 0 0 1 1.5 1.4L9.6 11.8M2.4 9.6l6 6M8.4 9.6l-6 6'],
  table: ['M2.6 3.6h12.8v10.8H2.6zM2.6 7.2h12.8M2.6 10.8h12.8M7 7.2v7.2'],
  options: ['M2.6 5.4h6.2M12.4 5.4h3M2.6 12.6h3M9.2 12.6h6.2', ['ring', 10.6, 5.4, 1.8], ['ring', 7.4, 12.6, 1.8]],
  crosshair: ['M9 1.8v4.7M9 11.5v4.7M1.8 9h4.7M11.5 9h4.7', ['dot', 9, 9]],
  ruler: ['M2.2 12.6 12.6 2.2l3.2 3.2L5.4 15.8zM5 9.8l1.5 1.5M7.4 7.4l1.9 1.9M9.9 4.9l1.5 1.5'],
  undo: ['M6.2 3.6 2.6 7.2l3.6 3.6M3 7.2h7.6a3.9 3.9 0 0 1 0 7.8H7.4'],
  redo: ['M11.8 3.6l3.6 3.6-3.6 3.6M15 7.2H7.4a3.9 3.9 0 0 0 0 7.8h3.2'],
  suggest: ['M6.6 12.3a4.9 4.9 0 1 1 4.8 0v1.5H6.6zM7.3 16.2h3.4'],
  import: ['M9 10.8V2.4M5.6 5.7 9 2.4l3.4 3.3M2.8 11.8v3.4h12.4v-3.4'],
  export: ['M9 2.4v8.4M5.6 7.5 9 10.8l3.4-3.3M2.8 11.8v3.4h12.4v-3.4'],
  theme: ['M9 2.4a6.6 6.6 0 1 1 0 13.2A6.6 6.6 0 0 1 9 2.4', ['half']],
  help: ['M6.4 6.6A2.7 2.7 0 1 1 9 9.6v1.6', ['dot', 9, 13.8]],
  eye: ['M1.6 9S4.2 4.2 9 4.2 16.4 9 16.4 9 13.8 13.8 9 13.8 1.6 9 1.6 9z', ['ring', 9, 9, 2.1]],
  hidden: ['M2.6 7C4 9.6 6.4 11 9 11s5-1.4 6.4-4M4.2 9.4l-1.6 2M9 11v2.6M13.8 9.4l1.6 2'],
  locked: ['M4.2 8.2h9.6v6.8H4.2zM6.2 8.2V5.8a2.8 2.8 0 0 1 5.6 0v2.4'],
  unlocked: ['M4.2 8.2h9.6v6.8H4.2zM6.2 8.2V5.4a2.8 2.8 0 0 1 5.4-1'],
  remove: ['M3.4 5h11.2M7 5V3.2h4V5M4.9 5l.6 10h7l.6-10M7.6 7.8v4.6M10.4 7.8v4.6'],
  duplicate: ['M6.6 6.6h8.2v8.2H6.6zM11.2 6.4V3.2H3.2v8h3.2'],
  rename: ['M3.2 14.8l.7-3.3L11.6 3.8l2.6 2.6-7.7 7.7z'],
  plus: ['M9 3.4v11.2M3.4 9h11.2'],
  large: ['M10.6 3h4.4v4.4M7.4 15H3v-4.4M14.6 3.4 10.4 7.6M3.4 14.6l4.2-4.2'],
  small: ['M14.8 7.4h-4.2V3.2M3.2 10.6h4.2v4.2M10.8 7.2l4-4M7.2 10.8l-4 4'],
  planes: ['M2.6 6.2 9 3l6.4 3.2L9 9.4zM2.6 9.4 9 12.6l6.4-3.2M2.6 12.4 9 15.6l6.4-3.2'],
  warning: ['M9 2.8 16 15H2zM9 7.2v3.8', ['dot', 9, 13]],
  window: ['M9 2.4a6.6 6.6 0 1 1 0 13.2A6.6 6.6 0 0 1 9 2.4', ['half']],
  home: ['M3 8.6 9 3.2l6 5.4M4.6 7.4v7.4h8.8V7.4'],
  flip: ['M9 2v14M6.4 5 2.4 13h4zM11.6 5l4 8h-4z'],
};

const SHAPES = {
  circle: (x, y, r) => svg('circle', {cx: x, cy: y, r, fill: 'currentColor', stroke: 'none'}),
  dot: (x, y) => svg('circle', {cx: x, cy: y, r: 1.3, fill: 'currentColor', stroke: 'none'}),
  ring: (x, y, r) => svg('circle', {cx: x, cy: y, r}),
  half: () => svg('path', {d: 'M9 2.4a6.6 6.6 0 0 1 0 13.2z', fill: 'currentColor', stroke: 'none'}),
};

export function icon(name) {
  const [path, ...shapes] = PATHS[name];
  return svg('svg', {viewBox: '0 0 18 18', class: 'drawn', 'aria-hidden': 'true'}, svg('path', {d: path}), ...shapes.map(([shape, ...values]) => SHAPES[shape](...values)));
}
