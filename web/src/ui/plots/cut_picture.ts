/** Picture of a cut through the surface under the own hand: the tip on the surface, the cursor below, the force as an arrow. */

import type { TouchState } from "../../model/hand";
import { forceShare } from "../../model/scale";
import { dot, norm, scale, sub } from "../../model/vec";
import { type Inks, sharpen } from "./canvas";

const DEEP = 0.03; // m from the resting surface to the lower end of the picture, at the least
const LONGEST = 50; // px; longest arrow

export interface Cut {
  /** Depths below the resting surface, as shares of the picture's depth; negative is above. */
  readonly cursor: number;
  readonly tip: number;
  readonly surface: number;
  /** Depth of the picture [m]. */
  readonly depth: number;
}

/** Heights in the picture. */
export function cut(state: Pick<TouchState, "target" | "probe" | "normal" | "depth" | "indentation">, before: number): Cut {
  const { target, probe, normal: n } = state;
  const beyond = (probe[0] - target[0]) * n[0] + (probe[1] - target[1]) * n[1] + (probe[2] - target[2]) * n[2];
  const cursor = state.depth + beyond;
  const most = Math.max(DEEP, 1.15 * cursor, 1.15 * state.depth);
  // The depth grows at once and shrinks slowly, so that the picture does not zoom with each motion of the hand.
  const depth = most > before ? most : Math.max(DEEP, before + 0.02 * (most - before));
  return { cursor: cursor / depth, tip: state.depth / depth, surface: Math.max(0, state.indentation) / depth, depth };
}

export class CutPicture {
  readonly canvas = document.createElement("canvas");
  private depth = DEEP;

  constructor() {
    this.canvas.className = "cut";
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", "Cut through the surface under your hand: tip, surface and cursor");
  }

  draw(state: TouchState, colour: string, ink: Inks): void {
    const w = this.canvas.clientWidth;
    const h = this.canvas.clientHeight;
    if (w === 0) return;
    const c = sharpen(this.canvas, w, h);
    if (c === null) return;
    const heights = cut(state, this.depth);
    this.depth = heights.depth;
    const top = 0.36 * h;
    const y = (share: number): number => Math.min(h - 5, Math.max(5, top + share * (h - top - 6)));
    const middle = 0.5 * w;
    c.clearRect(0, 0, w, h);
    // Draw the resting surface, then the dent in it.
    const dent = y(heights.surface) - top;
    const curve = (): void => {
      c.beginPath();
      c.moveTo(0, top);
      c.bezierCurveTo(0.3 * w, top, middle - 0.14 * w, top + dent, middle, top + dent);
      c.bezierCurveTo(middle + 0.14 * w, top + dent, 0.7 * w, top, w, top);
    };
    curve();
    c.lineTo(w, h);
    c.lineTo(0, h);
    c.closePath();
    c.fillStyle = ink.get("--flesh");
    c.fill();
    curve();
    c.strokeStyle = ink.text;
    c.lineWidth = 1.4;
    c.stroke();
    const tip = y(heights.surface > 0 ? heights.surface : Math.min(heights.tip, 0));
    const cursor = y(heights.cursor);
    c.strokeStyle = colour;
    c.lineWidth = 1.4;
    c.setLineDash([2, 2.5]);
    c.beginPath();
    c.moveTo(middle, tip);
    c.lineTo(middle, cursor);
    c.stroke();
    c.setLineDash([]);
    ring(c, middle, cursor, 4.5, colour, null);
    ring(c, middle, tip - 4.5, 4.5, colour, colour);
    arrow(c, [middle, tip - 9], Math.min(top + dent - 6, LONGEST * forceShare(norm(state.force))), lean(state), colour);
  }
}

function ring(c: CanvasRenderingContext2D, x: number, y: number, r: number, colour: string, fill: string | null): void {
  c.beginPath();
  c.arc(x, y, r, 0, 2 * Math.PI);
  c.lineWidth = 1.6;
  c.strokeStyle = colour;
  if (fill !== null) {
    c.fillStyle = fill;
    c.fill();
  }
  c.stroke();
}

/** Angle between force and normal [rad]; the cut lies in the plane of both. */
export function lean({ force, normal }: Pick<TouchState, "force" | "normal">): number {
  const out = dot(force, normal);
  return Math.atan2(norm(sub(force, scale(normal, out))), out);
}

function arrow(c: CanvasRenderingContext2D, from: readonly [number, number], length: number, lean: number, colour: string): void {
  if (length < 3) return;
  c.save();
  c.translate(...from);
  c.rotate(lean);
  const tip = Math.max(3 - from[1], -length);
  c.strokeStyle = c.fillStyle = colour;
  c.lineWidth = 2.5;
  c.beginPath();
  c.moveTo(0, 0);
  c.lineTo(0, tip + 4);
  c.stroke();
  c.beginPath();
  c.moveTo(-4.5, tip + 6);
  c.lineTo(4.5, tip + 6);
  c.lineTo(0, tip - 1);
  c.fill();
  c.restore();
}
