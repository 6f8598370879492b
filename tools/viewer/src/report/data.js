// Decodes the data that lib/src/report writes.
import {decodeCorners, decodePositions} from '../mesh_codec.js';

function bytesOf(base64) {
  const text = atob(base64), bytes = new Uint8Array(text.length);
  for (let n = 0; n < text.length; ++n) bytes[n] = text.charCodeAt(n);
  return bytes;
}

async function unpack(base64) {
  const stream = new Blob([bytesOf(base64)]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
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
  };
}

/** A number that distinguishes this page from others (FNV-1a over a part of its text). */
function digestOf(text) {
  let hash = 2166136261;
  for (let n = 0; n < text.length; n += 61) hash = Math.imul(hash ^ text.charCodeAt(n), 16777619);
  return `${text.length}-${(hash >>> 0).toString(16)}`;
}

/** The page's data, with decoded meshes but without decoded slices, and its digest. */
export async function readData() {
  const text = document.getElementById('data').textContent, data = JSON.parse(text);
  data.structures = await Promise.all(data.structures.map(decodeStructure));
  return {data, digest: digestOf(text)};
}
