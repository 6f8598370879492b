// The window of grey values, from black to white, and the colours in between.
import {colorTable} from './color_maps.js';

/** A table with the displayed pixel for each of the 65536 codes of a slice; the codes 0 to 65535 stand for `low` to `high`. */
export function greyTable({low, high}, {black, white}, colors = 'grey') {
  const shades = colorTable(colors), table = new Uint32Array(65536), scale = (high - low) / 65535, range = white - black || 1e-9;
  for (let n = 0; n < 65536; ++n) {
    table[n] = shades[Math.min(255, Math.max(0, Math.round(255 * (low + n * scale - black) / range)))];
  }
  table.key = `${black} ${white} ${colors}`;
  return table;
}

/** The range between the 1st and the 99th percentile of a slice. */
function rangeOfSlice({values}, {low, high}) {
  const counts = new Uint32Array(1024);
  for (let n = 0; n < values.length; ++n) ++counts[values[n] >> 6];
  const at = (share) => {
    let sum = 0, n = 0;
    while (n < 1023 && (sum += counts[n]) < share * values.length) ++n;
    return n;
  };
  const value = (n) => low + n / 1023 * (high - low);
  return {black: value(at(0.01)), white: value(at(0.99))};
}

/** The windows of grey values that a menu offers, as [name, window]; `slice` is the displayed slice or null. */
export function presets(image, slice) {
  const automatic = {black: image.black, white: image.white}, whole = {black: image.low, white: image.high}, list = [['automatic', automatic]];
  if (!isSame(automatic, whole)) list.push(['whole range', whole]);
  if (slice) list.push(['this slice', rangeOfSlice(slice, image)]);
  // CT images are recognised by Hounsfield units: air is -1000, and scanners report values from -4096 to 32767.
  const isAnatomicalCt = image.anatomical && image.low <= -500, looksLikeCt = image.low <= -900 && image.low >= -4096 && image.high <= 32767;
  if ((isAnatomicalCt || looksLikeCt) && image.high >= 300)
    list.push(['soft tissue', {black: -160, white: 240}], ['brain', {black: 0, white: 80}], ['bone', {black: -450, white: 1050}], ['lung', {black: -1350, white: 150}]);
  return list;
}

export const isSame = (a, b) => Math.abs(a.black - b.black) + Math.abs(a.white - b.white) <= 1e-6 * (Math.abs(a.white) + Math.abs(a.black) + 1e-12);
