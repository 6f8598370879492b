// Fetches and decodes the surfaces of the latest results.
import {decodeCorners, decodePositions} from '../mesh_codec.js';
import {indexCoordinates} from '../outline.js';

const HEAD = 40;  // bytes before the positions in the answer for a mesh
export const PREVIOUS_OUTLINE_MS = 1000;  // ms for which the previous surface is outlined, too, after a new one

function decode(buffer, space) {
  const view = new DataView(buffer), float3 = (at) => [0, 4, 8].map((n) => view.getFloat32(at + n, true));
  const mesh = {vertices: view.getUint32(0, true), triangles: view.getUint32(4, true), min: float3(8), max: float3(20)};
  const size = view.getUint32(32, true), bytes = new Uint8Array(buffer, HEAD);
  const positions = decodePositions(mesh, bytes.subarray(0, size)), corners = decodeCorners(mesh, bytes.subarray(size));
  return {...mesh, positions, corners, index: indexCoordinates(positions, space)};
}

/** Whether two meshes are the same surface, which may be received again after reconnecting. */
const isSame = (a, b) => a.vertices === b.vertices && a.triangles === b.triangles && a.min.every((x, n) => x === b.min[n]) && a.max.every((x, n) => x === b.max[n]);

export class Meshes {
  /** `changed(id, mesh or null)` is called for each surface that is added or removed. */
  constructor(space, changed) {
    Object.assign(this, {space, changed, items: new Map(), wanted: new Map()});
  }

  get(id) { return this.items.get(id) ?? null; }

  /** Handles a result; `isNew`: from a new connection, whose server may have restarted its version numbers. */
  async take({structure: id, version, stage, seq}, isNew) {
    if (stage === 'empty') return this.drop(id);
    const wanted = this.wanted.get(id);
    if (!isNew && wanted >= version) return;
    // While a structure is being solved, its version belongs to an earlier surface, which is fetched only if none was
    // requested before.
    if (!(version > 0) || (!['first', 'refined'].includes(stage) && !isNew && wanted)) return;
    this.wanted.set(id, version);
    let mesh = null;
    try {
      const answer = await fetch(`/mesh?structure=${id}&version=${version}`);
      if (answer.ok) mesh = decode(await answer.arrayBuffer(), this.space);
    } catch { /* the connection is lost: the next state includes the result */ }
    if (this.wanted.get(id) !== version) return;
    if (!mesh) this.wanted.delete(id);
    else this.put(id, {...mesh, id, version, seq, stage, arrived: performance.now(), isShown: false});
  }

  put(id, mesh) {
    const before = this.items.get(id);
    mesh.before = before && !isSame(before, mesh) ? {...before, before: null} : null;
    this.items.set(id, mesh);
    this.changed(id, mesh);
    setTimeout(() => {
      mesh.before = null;
      if (this.items.get(id) === mesh) this.changed(id, mesh, true);
    }, PREVIOUS_OUTLINE_MS);
  }

  drop(id) {
    this.wanted.delete(id);
    if (this.items.delete(id)) this.changed(id, null);
  }

  /** Removes the surfaces of structures that do not exist any more. */
  keepOnly(ids) {
    const kept = new Set(ids);
    for (const id of this.items.keys()) if (!kept.has(id)) this.drop(id);
  }
}
