// Where a mesh meets a plane of the image.

/** The mesh's vertices in the image's voxels: one array for each axis. */
export function indexCoordinates(positions, volume) {
  const count = positions.length / 3, result = [0, 1, 2].map(() => new Float32Array(count));
  volume.axes.forEach((axis, a) => {
    const scale = 1 / volume.spacing[a], out = result[a];
    const from = axis[0] * volume.origin[0] + axis[1] * volume.origin[1] + axis[2] * volume.origin[2];
    for (let n = 0; n < count; ++n)
      out[n] = (axis[0] * positions[3 * n] + axis[1] * positions[3 * n + 1] + axis[2] * positions[3 * n + 2] - from) * scale;
  });
  return result;
}

/** The segments x0, y0, x1, y1, ... in which triangles cross coordinates[axis] = at, in the two other axes. */
function cross(coordinates, corners, axis, at, [right, down]) {
  const along = coordinates[axis], xs = coordinates[right], ys = coordinates[down], segments = [];
  // A vertex on the plane counts as above it: no segment is found twice or lost.
  const edge = (a, b) => {
    const share = (at - along[a]) / (along[b] - along[a]);
    segments.push(xs[a] + share * (xs[b] - xs[a]), ys[a] + share * (ys[b] - ys[a]));
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

/** A structure's outline on a slice; the last one of each axis is kept. */
export function outlineAt(structure, axis, at, axes) {
  structure.outlines ??= [];
  const known = structure.outlines[axis];
  if (known?.at === at) return known.segments;
  // A lattice of marching cubes has vertices on slices: a little beside them no triangle lies in the plane.
  const segments = cross(structure.index, structure.corners, axis, at + 1e-4, axes);
  structure.outlines[axis] = {at, segments};
  return segments;
}
