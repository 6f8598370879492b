// Intersections of a mesh with a plane of the image.

/** The mesh's vertices in voxels of the image: one array for each axis. */
export function indexCoordinates(positions, volume) {
  const count = positions.length / 3, result = [0, 1, 2].map(() => new Float32Array(count));
  volume.duals.forEach((axis, a) => {
    const scale = 1 / volume.spacing[a], out = result[a];
    const from = axis[0] * volume.origin[0] + axis[1] * volume.origin[1] + axis[2] * volume.origin[2];
    for (let n = 0; n < count; ++n)
      out[n] = (axis[0] * positions[3 * n] + axis[1] * positions[3 * n + 1] + axis[2] * positions[3 * n + 2] - from) * scale;
  });
  return result;
}

/**
 * The segments x0, y0, x1, y1, ... in which triangles cross coordinates[axis] = at, in the two other axes. `edges` gets,
 * for each end, the number of the mesh's edge that it lies on.
 */
function cross(coordinates, corners, axis, at, [right, down], edges = null) {
  const along = coordinates[axis], xs = coordinates[right], ys = coordinates[down], segments = [], count = along.length;
  // A vertex exactly on the plane is treated as above it, so that a segment through this vertex is neither found twice
  // nor missed.
  const edge = (a, b) => {
    const share = (at - along[a]) / (along[b] - along[a]);
    segments.push(xs[a] + share * (xs[b] - xs[a]), ys[a] + share * (ys[b] - ys[a]));
    edges?.push(Math.min(a, b) * count + Math.max(a, b));
  };
  for (let n = 0; n < corners.length; n += 3) {
    const a = corners[n], b = corners[n + 1], c = corners[n + 2];
    const above = (along[a] >= at) | (along[b] >= at) << 1 | (along[c] >= at) << 2;
    if (above === 0 || above === 7) continue;
    if ((above & 1) !== (above >> 1 & 1)) edge(a, b);
    if ((above >> 1 & 1) !== (above >> 2)) edge(b, c);
    if ((above & 1) !== (above >> 2)) edge(c, a);
  }
  return segments;
}

/** A structure's outline on a slice; the latest one of each axis is cached. */
export function outlineAt(structure, axis, at, axes) {
  structure.outlines ??= [];
  const known = structure.outlines[axis];
  if (known?.at === at) return known.segments;
  // Marching cubes often place vertices exactly on slices. The plane is moved by a small offset, so that no triangle
  // lies in it.
  const segments = cross(structure.index, structure.corners, axis, at + 1e-4, axes);
  structure.outlines[axis] = {at, segments};
  return segments;
}

/** Joins segments whose ends are on the same edges to lines {places: [x0, y0, x1, y1, ...], closed}. */
function chain(segments, edges) {
  const ends = new Map(), used = new Uint8Array(edges.length / 2), lines = [];
  edges.forEach((edge, n) => { ends.has(edge) ? ends.get(edge).push(n) : ends.set(edge, [n]); });
  const place = (end) => [segments[2 * end], segments[2 * end + 1]];
  /** Follows the line from an end until it ends. */
  const follow = (end, places) => {
    for (let next = ends.get(edges[end]).find((other) => !used[other >> 1]); next !== undefined;) {
      used[next >> 1] = 1;
      const far = next ^ 1;
      places.push(place(far));
      next = ends.get(edges[far]).find((other) => !used[other >> 1]);
      end = far;
    }
    return end;
  };
  for (let n = 0; n < used.length; ++n) {
    if (used[n]) continue;
    used[n] = 1;
    const forward = [place(2 * n + 1)], last = follow(2 * n + 1, forward), closed = edges[last] === edges[2 * n];
    const backward = [place(2 * n)];
    if (!closed) follow(2 * n, backward);
    lines.push({places: [...backward.reverse(), ...forward].flat(), closed});
  }
  return lines;
}

/** Whether a slice meets the structure's extent: a quick test, because with many structures, a slice meets only a few of them. */
function isMet(structure, axis, at) {
  structure.spans ??= structure.index.map((along) => along.reduce(([low, high], x) => [Math.min(low, x), Math.max(high, x)], [Infinity, -Infinity]));
  const [low, high] = structure.spans[axis];
  return at >= low - 1 && at <= high + 1;
}

/** A structure's outline on a slice as lines; the latest one of each axis is cached. */
export function linesAt(structure, axis, at, axes) {
  structure.lines ??= [];
  const known = structure.lines[axis];
  if (known?.at === at) return known.lines;
  const edges = [], segments = isMet(structure, axis, at) ? cross(structure.index, structure.corners, axis, at + 1e-4, axes, edges) : [];
  const lines = chain(segments, edges);
  structure.lines[axis] = {at, lines};
  return lines;
}
