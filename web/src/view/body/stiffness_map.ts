/**
 * A map of the measured stiffness of the surface: each contact gives K_o at its place, and untouched places stay
 * blank. Newer values replace older ones, most strongly under the middle of the finger.
 */

import type { Vec3 } from "../../model/vec";

export class StiffnessMap {
  /** K_o [N/m], shape (n,), with its certainty, 0 to 1. */
  readonly values: Float32Array;
  readonly known: Float32Array;
  /** Least and largest measured value [N/m]. */
  low = Infinity;
  high = -Infinity;

  private readonly rest: Float32Array;

  /** @param rest Resting vertices, shape (n, 3) [m]. */
  constructor(rest: Float32Array) {
    this.rest = rest;
    this.values = new Float32Array(rest.length / 3);
    this.known = new Float32Array(rest.length / 3);
  }

  /**
   * Enter a measured value.
   *
   * @param foot Place on the resting surface [m].
   * @param k_o Stiffness [N/m].
   * @param reach Distance up to which the value counts [m].
   * @returns Whether the map changed.
   */
  add(foot: Vec3, k_o: number, reach: number): boolean {
    if (!(k_o > 0) || !Number.isFinite(k_o)) return false;
    this.low = Math.min(this.low, k_o);
    this.high = Math.max(this.high, k_o);
    let changed = false;
    for (let v = 0, i = 0; v < this.values.length; v++, i += 3) {
      const dx = (this.rest[i] ?? 0) - foot[0];
      const dy = (this.rest[i + 1] ?? 0) - foot[1];
      const dz = (this.rest[i + 2] ?? 0) - foot[2];
      const near = 1 - (dx * dx + dy * dy + dz * dz) / (reach * reach);
      if (near <= 0) continue;
      const before = this.known[v] ?? 0;
      const value = this.values[v] ?? 0;
      const share = before > 0 ? 0.3 * near : 1;
      const next = value + share * (k_o - value);
      const known = Math.max(before, Math.min(1, 1.6 * near));
      if (Math.abs(next - value) > 1e-3 * k_o || known > before) changed = true;
      this.values[v] = next;
      this.known[v] = known;
    }
    return changed;
  }

  get empty(): boolean {
    return !(this.low <= this.high);
  }
}
