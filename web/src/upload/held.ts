/** The held part of an object, as a rule for the server: a layer at one of its sides, or the painted part. */

import type { Vec3 } from "../model/vec";
import { MAX_RULE } from "./messages";

/** A layer at one side of the bounding box. */
export interface Layer {
  /** Axis of the layer: 0, 1 or 2. */
  readonly axis: number;
  /** Side of the box: -1 for the lower side. */
  readonly sign: -1 | 1;
  /** Thickness as a share of the box's extent [%]. */
  readonly share: number;
}

export interface Box {
  readonly low: Vec3;
  readonly high: Vec3;
}

const AXES = "xyz";
const CELLS = 18; // cells of the painted grid along the longest side
// Radius of the brush, in cells: a tenth of the object, so that vertices of its tetrahedra lie in it.
const BRUSH = 1.8;

/** Bounding box of vertices, shape (n, 3). */
export function boxOf(vertices: Float32Array): Box {
  const low: [number, number, number] = [Infinity, Infinity, Infinity];
  const high: [number, number, number] = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < vertices.length; i++) {
    const k = (i % 3) as 0 | 1 | 2;
    low[k] = Math.min(low[k], vertices[i] ?? 0);
    high[k] = Math.max(high[k], vertices[i] ?? 0);
  }
  return { low, high };
}

/** Rule of a layer for the server, such as "z < 5%". */
export function layerRule({ axis, sign, share }: Layer): string {
  return sign < 0 ? `${AXES[axis] ?? "z"} < ${share}%` : `${AXES[axis] ?? "z"} > ${100 - share}%`;
}

/** The layer of a rule of the server; null if the rule is of another kind. */
export function layerOf(rule: string): Layer | null {
  const found = /^([xyz]) ([<>]) (\d{1,2})%$/.exec(rule);
  if (found === null) return null;
  const [, axis = "z", sense, share = "0"] = found;
  return { axis: AXES.indexOf(axis), sign: sense === "<" ? -1 : 1, share: sense === "<" ? Number(share) : 100 - Number(share) };
}

/** Coordinate along its axis at which the layer ends [m]. */
export function layerEnd({ axis, sign, share }: Layer, box: Box): number {
  const low = box.low[axis] ?? 0;
  const high = box.high[axis] ?? 0;
  return sign < 0 ? low + 0.01 * share * (high - low) : high - 0.01 * share * (high - low);
}

/** Painted cells of a grid round an object. */
export class Painting {
  /** Number of cells along x, y, z. */
  readonly counts: Vec3;
  /** Edge of a cell [m]. */
  readonly cell: number;
  /** Corner of the first cell [m]. */
  readonly origin: Vec3;
  /** Cells, x fastest: 255 where painted; the texture is made of this array. */
  readonly cells: Uint8Array;

  constructor(box: Box) {
    const [w, d, h] = [0, 1, 2].map((k) => (box.high[k] ?? 0) - (box.low[k] ?? 0)) as unknown as Vec3;
    this.cell = Math.max(w, d, h) / CELLS;
    // The grid extends half a cell beyond the box, so that a surface on the box lies inside a cell and not between two.
    const around = (x: number): number => Math.ceil(x / this.cell + 1);
    this.counts = [around(w), around(d), around(h)];
    this.origin = [0, 1, 2].map((k) => 0.5 * ((box.low[k] ?? 0) + (box.high[k] ?? 0) - (this.counts[k] ?? 0) * this.cell)) as unknown as Vec3;
    this.cells = new Uint8Array(this.counts[0] * this.counts[1] * this.counts[2]);
  }

  get empty(): boolean {
    return !this.cells.includes(255);
  }

  clear(): void {
    this.cells.fill(0);
  }

  /** Paint a ball round a point. @returns Whether any cell changed. */
  paint(at: Vec3): boolean {
    const middle = at.map((x, k) => (x - (this.origin[k] ?? 0)) / this.cell);
    const range = (k: 0 | 1 | 2): number[] => {
      const first = Math.max(0, Math.floor((middle[k] ?? 0) - BRUSH));
      const last = Math.min(this.counts[k] - 1, Math.floor((middle[k] ?? 0) + BRUSH));
      return Array.from({ length: Math.max(0, last - first + 1) }, (_, i) => first + i);
    };
    let changed = false;
    for (const z of range(2)) {
      for (const y of range(1)) {
        for (const x of range(0)) {
          const away = Math.hypot(x + 0.5 - (middle[0] ?? 0), y + 0.5 - (middle[1] ?? 0), z + 0.5 - (middle[2] ?? 0));
          const i = this.index(x, y, z);
          if (away > BRUSH || this.cells[i] === 255) continue;
          this.cells[i] = 255;
          changed = true;
        }
      }
    }
    return changed;
  }

  /** A few boxes that together contain exactly the painted cells; each is grown as far as possible. */
  boxes(): Box[] {
    const left = Uint8Array.from(this.cells);
    const free = (x: readonly number[], y: readonly number[], z: readonly number[]): boolean =>
      z.every((k) => y.every((j) => x.every((i) => left[this.index(i, j, k)] === 255)));
    const boxes: Box[] = [];
    const [nx, ny, nz] = this.counts;
    for (let z = 0; z < nz; z++) {
      for (let y = 0; y < ny; y++) {
        for (let x = 0; x < nx; x++) {
          if (left[this.index(x, y, z)] !== 255) continue;
          const [xs, ys, zs] = [[x], [y], [z]];
          while (x + xs.length < nx && free([x + xs.length], ys, zs)) xs.push(x + xs.length);
          while (y + ys.length < ny && free(xs, [y + ys.length], zs)) ys.push(y + ys.length);
          while (z + zs.length < nz && free(xs, ys, [z + zs.length])) zs.push(z + zs.length);
          for (const k of zs) for (const j of ys) for (const i of xs) left[this.index(i, j, k)] = 0;
          boxes.push({ low: this.corner(x, y, z), high: this.corner(x + xs.length, y + ys.length, z + zs.length) });
        }
      }
    }
    return boxes;
  }

  /**
   * The rule of the painted part; empty if nothing is painted, null if the rule is too long for the server.
   *
   * @param larger How many times larger the object will be than it is here.
   * @param middle Point of the file that is the origin here [m].
   */
  rule(larger = 1, middle: Vec3 = [0, 0, 0]): string | null {
    // Digits down to a thousandth of a cell, however far from the origin of its file the object lies.
    const digits = Math.min(20, Math.max(0, Math.ceil(3 - Math.log10(larger * this.cell))));
    const short = (x: number, k: number): string => `${Number((larger * (x + (middle[k] ?? 0))).toFixed(digits))}`;
    const one = ({ low, high }: Box): string =>
      [0, 1, 2].map((k) => `${AXES[k] ?? "x"}>${short(low[k] ?? 0, k)} and ${AXES[k] ?? "x"}<${short(high[k] ?? 0, k)}`).join(" and ");
    const rule = this.boxes().map(one).join(" or ");
    return rule.length > MAX_RULE ? null : rule;
  }

  private index(x: number, y: number, z: number): number {
    return x + this.counts[0] * (y + this.counts[1] * z);
  }

  private corner(x: number, y: number, z: number): Vec3 {
    return [this.origin[0] + x * this.cell, this.origin[1] + y * this.cell, this.origin[2] + z * this.cell];
  }
}
