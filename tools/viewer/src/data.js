// What lib/src/report writes, decoded.

function bytesOf(base64) {
  const text = atob(base64), bytes = new Uint8Array(text.length);
  for (let n = 0; n < text.length; ++n) bytes[n] = text.charCodeAt(n);
  return bytes;
}

async function unpack(base64) {
  const stream = new Blob([bytesOf(base64)]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** lib/src/report/mesh_codec.h says how vertices are coded. */
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

function decodeValues({min, max}, steps) {
  const values = new Float32Array(steps.length);
  for (let n = 0, at = 0; n < steps.length; ++n) {
    at = (at + steps[n]) & 255;
    values[n] = min + at / 255 * (max - min);
  }
  return {min, max, values};
}

async function decodeStructure(structure) {
  const mesh = structure.mesh;
  const [positions, corners, marks] = await Promise.all([unpack(mesh.positions), unpack(mesh.corners), unpack(structure.marks.data)]);
  const values = {};
  for (const [name, coded] of Object.entries(mesh.values)) values[name] = decodeValues(coded, await unpack(coded.data));
  return {
    ...structure,
    positions: decodePositions(mesh, positions),
    corners: decodeCorners(mesh, corners),
    markCount: structure.marks.count,
    marks: new Float32Array(marks.buffer, 0, marks.length >> 2),
    values,
    visible: true,
  };
}

/** The page's data, meshes decoded, slices not yet. */
export async function readData() {
  const data = JSON.parse(document.getElementById('data').textContent);
  data.structures = await Promise.all(data.structures.map(decodeStructure));
  return data;
}
