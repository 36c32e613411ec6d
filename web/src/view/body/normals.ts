/** Normals of a deformed surface, and displacements of its vertices along the resting normals. */

/**
 * Smooth normals at the vertices, exact on spheres whatever the triangles (Max 1999: each face counts by
 * its edges' cross product over the squares of their lengths).
 *
 * @param positions Positions of the vertices, shape (n, 3) [m].
 * @param faces Corners, counter-clockwise seen from outside, shape (m, 3).
 * @param out Normals, shape (n, 3), overwritten.
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
    const ux = (p[b] ?? 0) - (p[a] ?? 0);
    const uy = (p[b + 1] ?? 0) - (p[a + 1] ?? 0);
    const uz = (p[b + 2] ?? 0) - (p[a + 2] ?? 0);
    const vx = (p[c] ?? 0) - (p[a] ?? 0);
    const vy = (p[c + 1] ?? 0) - (p[a + 1] ?? 0);
    const vz = (p[c + 2] ?? 0) - (p[a + 2] ?? 0);
    const ab = ux * ux + uy * uy + uz * uz || 1;
    const ac = vx * vx + vy * vy + vz * vz || 1;
    const bc = (vx - ux) ** 2 + (vy - uy) ** 2 + (vz - uz) ** 2 || 1;
    const nx = uy * vz - uz * vy;
    const ny = uz * vx - ux * vz;
    const nz = ux * vy - uy * vx;
    weigh(out, a, nx, ny, nz, 1 / (ab * ac));
    weigh(out, b, nx, ny, nz, 1 / (ab * bc));
    weigh(out, c, nx, ny, nz, 1 / (ac * bc));
  }
  for (let i = 0; i + 2 < out.length; i += 3) {
    const length = Math.hypot(out[i] ?? 0, out[i + 1] ?? 0, out[i + 2] ?? 0) || 1;
    out[i] = (out[i] ?? 0) / length;
    out[i + 1] = (out[i + 1] ?? 0) / length;
    out[i + 2] = (out[i + 2] ?? 0) / length;
  }
  return out;
}

function weigh(out: Float32Array, i: number, x: number, y: number, z: number, weight: number): void {
  out[i] = (out[i] ?? 0) + weight * x;
  out[i + 1] = (out[i + 1] ?? 0) + weight * y;
  out[i + 2] = (out[i + 2] ?? 0) + weight * z;
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
