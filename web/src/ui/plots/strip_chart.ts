/** Live plots on a canvas: lanes over one time axis, each with its scale, its lines and its name. */

import { digits, follow, linear, type Range, ticks } from "../../model/scale";
import { type Inks, sharpen } from "./canvas";
import type { TraceBuffer } from "./trace_buffer";

export interface Line {
  /** Column of the buffer. */
  readonly column: number;
  /** Custom property that holds the colour, or a colour. */
  readonly colour: string;
  readonly dashed?: boolean;
  /** Written beside the lane's name where a lane has several lines. */
  readonly name?: string;
}

export interface Lane {
  readonly name: string;
  readonly unit: string;
  /** Factor from SI to the unit at the axis. */
  readonly factor: number;
  /** Least width of the scale, in SI. */
  readonly least: number;
  /** Zero stays in sight. */
  readonly zero: boolean;
  readonly height: number;
  readonly lines: readonly Line[];
}

const LEFT = 34;
const RIGHT = 6;
const TOP = 15;
const GAP = 9;
/** Longer between two samples, and nothing is known of what was between [s]. */
export const UNKNOWN = 1;
const HATCH = 6; // px between two lines of it

export class StripChart {
  readonly canvas = document.createElement("canvas");
  private readonly lanes: readonly Lane[];
  private readonly ranges: (Range | null)[];
  readonly height: number;

  constructor(lanes: readonly Lane[], label: string) {
    this.lanes = lanes;
    this.ranges = lanes.map(() => null);
    this.height = lanes.reduce((sum, lane) => sum + lane.height + TOP + GAP, 0);
    this.canvas.className = "plot";
    this.canvas.style.height = `${this.height}px`;
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", label);
  }

  /**
   * @param now Time at the right edge [s].
   * @param span That the axis is long [s].
   */
  draw(data: TraceBuffer, now: number, span: number, ink: Inks): void {
    const width = this.canvas.clientWidth;
    if (width === 0) return;
    const c = sharpen(this.canvas, width, this.height);
    if (c === null) return;
    c.clearRect(0, 0, width, this.height);
    c.font = getComputedStyle(this.canvas).font;
    const x = linear({ low: now - span, high: now }, { low: LEFT, high: width - RIGHT });
    let top = 0;
    this.lanes.forEach((lane, i) => {
      const columns = lane.lines.map((line) => line.column);
      const extent = data.range(columns, now - span);
      const range = follow(this.ranges[i] ?? null, withZero(extent, lane), lane.least);
      this.ranges[i] = range;
      const y = linear(range, { low: top + TOP + lane.height, high: top + TOP });
      axis(c, lane, range, y, width, top, ink);
      for (const [from, to] of gaps(data, now - span, now)) hatch(c, x(from), x(to), top + TOP, lane.height, ink);
      for (const line of lane.lines) trace(c, data, line, x, y, now - span, ink);
      top += TOP + lane.height + GAP;
    });
  }
}

/** The range that a lane shows: its data with zero, and no less than its least width. */
export function withZero(extent: Range | null, lane: Pick<Lane, "zero" | "least">): Range {
  const data = extent ?? { low: 0, high: 0 };
  const low = lane.zero ? Math.min(0, data.low) : data.low;
  const high = lane.zero ? Math.max(0, data.high) : data.high;
  return { low, high: Math.max(high, low + lane.least) };
}

/** Spans of [since, now] in which no sample was taken, though there were some before. */
export function gaps(data: TraceBuffer, since: number, now: number): [number, number][] {
  const found: [number, number][] = [];
  let last: number | null = null;
  const upTo = (time: number): void => {
    if (last !== null && time - last > UNKNOWN && time > since) found.push([Math.max(since, last), time]);
    last = time;
  };
  data.each(0, -Infinity, upTo);
  upTo(now);
  return found;
}

/** Slanted lines over what is not known. */
function hatch(c: CanvasRenderingContext2D, left: number, right: number, top: number, height: number, ink: Inks): void {
  c.save();
  c.beginPath();
  c.rect(left, top, right - left, height);
  c.clip();
  c.strokeStyle = ink.get("--line-2");
  c.lineWidth = 1;
  c.beginPath();
  for (let x = left - height; x < right; x += HATCH) {
    c.moveTo(x, top + height);
    c.lineTo(x + height, top);
  }
  c.stroke();
  c.restore();
}

function axis(
  c: CanvasRenderingContext2D,
  lane: Lane,
  range: Range,
  y: (v: number) => number,
  width: number,
  top: number,
  ink: Inks,
): void {
  c.fillStyle = ink.text;
  c.textBaseline = "middle";
  c.textAlign = "left";
  c.fillText(`${lane.name}, ${lane.unit}`, LEFT, top + 6);
  key(c, lane, width, top, ink);
  c.textAlign = "right";
  c.lineWidth = 1;
  const marks = ticks({ low: lane.factor * range.low, high: lane.factor * range.high }, lane.height > 50 ? 3 : 2);
  const places = digits((marks[1] ?? 1) - (marks[0] ?? 0));
  for (const mark of marks) {
    const at = Math.round(y(mark / lane.factor)) + 0.5;
    c.strokeStyle = ink.faint;
    c.beginPath();
    c.moveTo(LEFT, at);
    c.lineTo(width - RIGHT, at);
    c.stroke();
    c.fillText(mark.toFixed(places).replace("-", "\u2212"), LEFT - 6, at);
  }
}

/** Names of several lines, each after a piece of it, from the right. */
function key(c: CanvasRenderingContext2D, lane: Lane, width: number, top: number, ink: Inks): void {
  let right = width - RIGHT;
  for (const line of lane.lines) {
    if (line.name === undefined) continue;
    right -= c.measureText(line.name).width;
    c.fillText(line.name, right, top + 6);
    c.strokeStyle = ink.get(line.colour);
    c.lineWidth = 1.6;
    c.setLineDash(line.dashed === true ? [3, 2.5] : []);
    c.beginPath();
    c.moveTo(right - 18, top + 6);
    c.lineTo(right - 4, top + 6);
    c.stroke();
    c.setLineDash([]);
    right -= 30;
  }
}

function trace(
  c: CanvasRenderingContext2D,
  data: TraceBuffer,
  line: Line,
  x: (t: number) => number,
  y: (v: number) => number,
  since: number,
  ink: Inks,
): void {
  c.strokeStyle = ink.get(line.colour);
  c.lineWidth = line.dashed === true ? 1.2 : 1.6;
  c.setLineDash(line.dashed === true ? [3, 2.5] : []);
  c.lineJoin = "round";
  c.beginPath();
  let pen = false;
  let last = -Infinity;
  data.each(line.column, since, (time, value) => {
    if (time - last > UNKNOWN) pen = false;
    last = time;
    if (Number.isNaN(value)) {
      pen = false;
      return;
    }
    if (pen) c.lineTo(x(time), y(value));
    else c.moveTo(x(time), y(value));
    pen = true;
  });
  c.stroke();
  c.setLineDash([]);
}
