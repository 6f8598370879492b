// Colours of values: viridis (Smith and van der Walt, 2015), which colour-blind readers can distinguish, too.
const VIRIDIS = [[68, 1, 84], [72, 40, 120], [62, 74, 137], [49, 104, 142], [38, 130, 142], [31, 158, 137], [53, 183, 121],
  [110, 206, 88], [181, 222, 43], [253, 231, 37]];
export const SUPPORT = [[68, 119, 170], [102, 190, 170], [220, 95, 60]];

export function viridis(share) {
  const at = Math.min(1, Math.max(0, share)) * (VIRIDIS.length - 1), n = Math.min(VIRIDIS.length - 2, Math.floor(at));
  return VIRIDIS[n].map((low, c) => low + (at - n) * (VIRIDIS[n + 1][c] - low));
}

/** The quantities that a surface can be coloured by, if their values are known. */
export function colorings(structures) {
  const has = (name) => structures.some((s) => s.values[name]);
  const list = [['structure', 'structure']];
  if (has('distance_to_marks')) list.push(['distance_to_marks', 'distance to marks']);
  if (has('edge_strength')) list.push(['edge_strength', 'edge strength']);
  if (has('distance_to_marks') && has('edge_strength') && structures.some((s) => s.evidence)) list.push(['support', 'what it rests on']);
  return list;
}

/** The range of a value over the structures. */
export function rangeOf(structures, name) {
  const all = structures.map((s) => s.values[name]).filter(Boolean);
  if (name === 'edge_strength') return [0, 1];
  return [Math.min(...all.map((v) => v.min)), Math.max(...all.map((v) => v.max))];
}

/** Red, green, blue in [0,1] at each vertex. */
export function vertexColors(structure, name, range) {
  const count = structure.positions.length / 3, colors = new Float32Array(3 * count);
  const put = (n, rgb) => { for (let c = 0; c < 3; ++c) colors[3 * n + c] = (rgb[c] / 255) ** 2.2; };
  const distance = structure.values.distance_to_marks?.values, edge = structure.values.edge_strength?.values;
  for (let n = 0; n < count; ++n) {
    if (name === 'support' && structure.evidence)
      put(n, SUPPORT[distance && distance[n] <= structure.evidence.reach ? 0 : edge && edge[n] >= structure.evidence.weak_edge ? 1 : 2]);
    else if (structure.values[name])
      put(n, viridis((structure.values[name].values[n] - range[0]) / (range[1] - range[0] || 1)));
    else put(n, [150, 150, 150]);
  }
  return colors;
}
