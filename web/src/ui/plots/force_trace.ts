/** One large trace over the stage: the own force, and another force on the same scale for comparison. */

import { digits, follow, linear, type Range, ticks } from "../../model/scale";
import { type Inks, sharpen } from "./canvas";

const LEFT = 40;
const RIGHT = 10;
const TOP = 8;
const BOTTOM = 8;
const LEAST = 2; // N that the scale shows at least
const HEIGHT = 150;

/** Samples of a force: times [s], rising, and values [N]. */
export interface Course {
  readonly times: readonly number[];
  readonly forces: readonly number[];
}

export class ForceTrace {
  readonly root = document.createElement("figure");
  private readonly canvas = document.createElement("canvas");
  private readonly mine = document.createElement("span");
  private readonly other = document.createElement("span");
  private range: Range | null = null;

  constructor() {
    this.root.className = "trace";
    this.root.hidden = true;
    this.canvas.className = "trace-canvas";
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", "Your force over the last seconds");
    this.mine.className = "trace-mine";
    this.other.className = "trace-other";
    const head = document.createElement("figcaption");
    head.className = "trace-head";
    head.append(this.mine, this.other);
    this.root.append(head, this.canvas);
  }

  /**
   * @param now Time at the right edge, on the clock of `mine` [s].
   * @param span Length of the time axis [s].
   * @param other Force of which the last `span` seconds are shown; null for none.
   */
  draw(mine: Course, other: Course | null, words: readonly [string, string], now: number, span: number, colour: string, ink: Inks): void {
    [this.mine.textContent, this.other.textContent] = words;
    this.other.hidden = words[1] === "";
    const width = this.canvas.clientWidth;
    if (width === 0) return;
    const c = sharpen(this.canvas, width, HEIGHT);
    if (c === null) return;
    c.clearRect(0, 0, width, HEIGHT);
    c.font = getComputedStyle(this.canvas).font;
    const high = Math.max(0, ...mine.forces, ...(other?.forces ?? []));
    this.range = follow(this.range, { low: 0, high: Math.max(high, LEAST) }, LEAST);
    const y = linear(this.range, { low: HEIGHT - BOTTOM, high: TOP });
    scaleLines(c, this.range, y, width, ink);
    const pixels = { low: LEFT, high: width - RIGHT };
    if (other !== null) {
      const end = other.times.at(-1) ?? 0;
      stroke(c, other, linear({ low: end - span, high: end }, pixels), y, end - span, ink.get("--others"), [7, 4]);
    }
    stroke(c, mine, linear({ low: now - span, high: now }, pixels), y, now - span, colour, []);
  }
}

function scaleLines(c: CanvasRenderingContext2D, range: Range, y: (v: number) => number, width: number, ink: Inks): void {
  const marks = ticks(range, 3);
  const places = digits((marks[1] ?? 1) - (marks[0] ?? 0));
  c.fillStyle = ink.text;
  c.textAlign = "right";
  c.textBaseline = "middle";
  c.lineWidth = 1;
  c.strokeStyle = ink.faint;
  for (const mark of marks) {
    const at = Math.round(y(mark)) + 0.5;
    c.beginPath();
    c.moveTo(LEFT, at);
    c.lineTo(width - RIGHT, at);
    c.stroke();
    c.fillText(`${mark.toFixed(places)} N`, LEFT - 5, Math.min(HEIGHT - 7, Math.max(7, at)));
  }
}

function stroke(
  c: CanvasRenderingContext2D, { times, forces }: Course, x: (t: number) => number, y: (v: number) => number, since: number, colour: string, dash: number[],
): void {
  c.strokeStyle = colour;
  c.lineWidth = dash.length > 0 ? 1.8 : 2.4;
  c.lineJoin = "round";
  c.setLineDash(dash);
  c.beginPath();
  let pen = false;
  times.forEach((t, i) => {
    if (t < since) return;
    const force = forces[i] ?? 0;
    if (pen) c.lineTo(x(t), y(force));
    else c.moveTo(x(t), y(force));
    pen = true;
  });
  c.stroke();
  c.setLineDash([]);
}
