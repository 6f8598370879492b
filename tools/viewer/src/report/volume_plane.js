// The image of a page on an oblique plane.

/** The volume's value at a fractional index, 0 to 255; -1 outside. */
function sample({data, size: [nx, ny, nz]}, i, j, k) {
  if (i < -0.5 || j < -0.5 || k < -0.5 || i > nx - 0.5 || j > ny - 0.5 || k > nz - 0.5) return -1;
  const hold = (x, n) => Math.min(n - 1, Math.max(0, x)), [x, y, z] = [hold(i, nx), hold(j, ny), hold(k, nz)], [a, b, c] = [Math.floor(x), Math.floor(y), Math.floor(z)];
  const dx = a < nx - 1 ? 1 : 0, dy = b < ny - 1 ? nx : 0, dz = c < nz - 1 ? nx * ny : 0, n = (c * ny + b) * nx + a, fx = x - a, fy = y - b;
  const layer = (at) => (data[at] * (1 - fx) + data[at + dx] * fx) * (1 - fy) + (data[at + dy] * (1 - fx) + data[at + dy + dx] * fx) * fy;
  return layer(n) * (1 - (z - c)) + layer(n + dz) * (z - c);
}

/** Returns a function that an ObliquePlane calls for its codes. */
export function codesOf(volume) {
  return Object.assign(({first, alongX, alongY, count}) => {
    const codes = new Uint16Array(count * count);
    for (let y = 0, n = 0; y < count; ++y)
      for (let x = 0; x < count; ++x) {
        const value = sample(volume, first[0] + x * alongX[0] + y * alongY[0], first[1] + x * alongX[1] + y * alongY[1], first[2] + x * alongX[2] + y * alongY[2]);
        codes[n++] = Math.max(0, Math.round(257 * value));
      }
    return codes;
  }, {generation: () => volume.decoded.reduce((sum, one) => sum + one, 0)});
}
