/** Normals of a deformed surface, and how far each vertex went along the resting ones. */

/**
 * Smooth normals at the vertices: the mean of the faces round each, by their area.
 *
 * @param positions Shape (n, 3) [m].
 * @param faces Counter-clockwise seen from outside, shape (m, 3).
 * @param out Shape (n, 3), overwritten.
 */
export function vertexNormals(
  positions: Float32Array,
  faces: Uint32Array,
  out: Float32Array = new Float32Array(positions.length),
): Float32Array {
  const p = positions;
  out.fill(0);
  for (let f = 0; f + 2 < faces.length; f += 3) {
    const a = 3 * (faces[f] ?? 0);
    const b = 3 * (faces[f + 1] ?? 0);
    const c = 3 * (faces[f + 2] ?? 0);
    const ax = p[a] ?? 0;
    const ay = p[a + 1] ?? 0;
    const az = p[a + 2] ?? 0;
    const ux = (p[b] ?? 0) - ax;
    const uy = (p[b + 1] ?? 0) - ay;
    const uz = (p[b + 2] ?? 0) - az;
    const vx = (p[c] ?? 0) - ax;
    const vy = (p[c + 1] ?? 0) - ay;
    const vz = (p[c + 2] ?? 0) - az;
    const nx = uy * vz - uz * vy;
    const ny = uz * vx - ux * vz;
    const nz = ux * vy - uy * vx;
    for (const i of [a, b, c]) {
      out[i] = (out[i] ?? 0) + nx;
      out[i + 1] = (out[i + 1] ?? 0) + ny;
      out[i + 2] = (out[i + 2] ?? 0) + nz;
    }
  }
  for (let i = 0; i + 2 < out.length; i += 3) {
    const length = Math.hypot(out[i] ?? 0, out[i + 1] ?? 0, out[i + 2] ?? 0) || 1;
    out[i] = (out[i] ?? 0) / length;
    out[i + 1] = (out[i + 1] ?? 0) / length;
    out[i + 2] = (out[i + 2] ?? 0) / length;
  }
  return out;
}

/**
 * Displacement along the resting normals, outward positive, shape (n,) [m].
 *
 * @returns The largest magnitude [m].
 */
export function alongNormals(
  positions: Float32Array,
  rest: Float32Array,
  normals: Float32Array,
  out: Float32Array,
): number {
  let most = 0;
  for (let v = 0, i = 0; v < out.length; v++, i += 3) {
    const d =
      ((positions[i] ?? 0) - (rest[i] ?? 0)) * (normals[i] ?? 0) +
      ((positions[i + 1] ?? 0) - (rest[i + 1] ?? 0)) * (normals[i + 1] ?? 0) +
      ((positions[i + 2] ?? 0) - (rest[i + 2] ?? 0)) * (normals[i + 2] ?? 0);
    out[v] = d;
    if (Math.abs(d) > most) most = Math.abs(d);
  }
  return most;
}
