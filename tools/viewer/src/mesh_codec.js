// Decodes meshes as encoded by lib/src/report/mesh_codec.h.

export function decodePositions(mesh, bytes) {
  const count = mesh.vertices, positions = new Float32Array(3 * count);
  for (let a = 0; a < 3; ++a) {
    const low = 2 * a * count, high = low + count, scale = (mesh.max[a] - mesh.min[a]) / 65535;
    for (let n = 0, at = 0; n < count; ++n) {
      at = (at + bytes[low + n] + 256 * bytes[high + n]) & 65535;
      positions[3 * n + a] = mesh.min[a] + at * scale;
    }
  }
  return positions;
}

export function decodeCorners(mesh, bytes) {
  const corners = new Uint32Array(3 * mesh.triangles);
  for (let n = 0, at = 0, fresh = 0; n < corners.length; ++n) {
    let behind = 0;
    for (let shift = 0;; shift += 7) {
      const byte = bytes[at++];
      behind |= (byte & 127) << shift;
      if (byte < 128) break;
    }
    corners[n] = fresh - behind;
    if (behind === 0) ++fresh;
  }
  return corners;
}
