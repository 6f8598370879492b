// Colour maps for slices: a few colours of each, with interpolation between them.

const MAPS = {
  grey: [[0, 0, 0], [255, 255, 255]],
  inverted: [[255, 255, 255], [0, 0, 0]],
  viridis: [[68, 1, 84], [71, 44, 122], [59, 81, 139], [44, 113, 142], [33, 144, 141], [39, 173, 129], [92, 200, 99], [170, 220, 50], [253, 231, 37]],
  magma: [[0, 0, 4], [28, 16, 68], [79, 18, 123], [129, 37, 129], [181, 54, 122], [229, 80, 100], [251, 135, 97], [254, 194, 135], [252, 253, 191]],
};
export const COLOR_MAPS = Object.keys(MAPS);

/** 256 colours as pixels (Uint32). `name` is a key of MAPS, or a colour [red, green, blue] for a map from black to this colour. */
export function colorTable(name) {
  const map = Array.isArray(name) ? [[0, 0, 0], name] : MAPS[name] ?? MAPS.grey, table = new Uint32Array(256);
  for (let n = 0; n < 256; ++n) {
    const at = n / 255 * (map.length - 1), from = Math.min(map.length - 2, Math.floor(at)), share = at - from;
    const [r, g, b] = map[from].map((v, c) => Math.round(v + share * (map[from + 1][c] - v)));
    table[n] = (0xff000000 | b << 16 | g << 8 | r) >>> 0;
  }
  return table;
}
