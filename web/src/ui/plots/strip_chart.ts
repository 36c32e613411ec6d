/** Plots on a canvas, live or of a replay: lanes over one time axis, each with scale, lines and name, and a cursor for values. */

import { follow, linear, type Range } from "../../model/scale";
import { type Inks, sharpen } from "./canvas";
import { moved, type PlotCursor, readout, valuesAt } from "./cursor";
import { type Lane, UNKNOWN, withZero, written } from "./lanes";
import { axis, dot, GAP, hatch, LEFT, RIGHT, rule, TOP, trace } from "./strokes";
import type { TraceBuffer } from "./trace_buffer";

const HINT = "Point at the plot to read its values.";

/** Data that a chart shows. */
export interface Charted {
  readonly data: TraceBuffer;
  /** Time at the right edge [s]. */
  readonly end: number;
  /** Length of the time axis [s]. */
  readonly span: number;
  /** Time that a replay shows [s]; null without a replay: the right edge is then now. */
  readonly shown: number | null;
}

export class StripChart {
  readonly root = document.createElement("div");
  private readonly canvas = document.createElement("canvas");
  private readonly words = document.createElement("p");
  private readonly lanes: readonly Lane[];
  private readonly ranges: (Range | null)[];
  private readonly height: number;
  private readonly cursor: PlotCursor;
  private last: readonly [Charted, Inks] | null = null;

  /** @param cursor Cursor that all charts of one time axis share. */
  constructor(lanes: readonly Lane[], label: string, cursor: PlotCursor) {
    this.lanes = lanes;
    this.cursor = cursor;
    this.ranges = lanes.map(() => null);
    this.height = lanes.reduce((sum, lane) => sum + lane.height + TOP + GAP, 0);
    this.canvas.className = "plot";
    this.canvas.style.height = `${this.height}px`;
    this.canvas.tabIndex = 0;
    for (const [name, value] of [["role", "slider"], ["aria-label", label], ["aria-valuemin", "0"], ["aria-valuemax", "1"], ["aria-valuenow", "1"], ["aria-valuetext", HINT]] as const) {
      this.canvas.setAttribute(name, value);
    }
    this.canvas.addEventListener("pointermove", (event) => { this.point(event); });
    this.canvas.addEventListener("pointerdown", (event) => { this.point(event); });
    // A lifted finger leaves the cursor where it was, so that the values can be read.
    this.canvas.addEventListener("pointerleave", ({ pointerType }) => { if (pointerType === "mouse") this.put(null); });
    this.canvas.addEventListener("keydown", (event) => {
      if (this.last === null || event.ctrlKey || event.metaKey || event.altKey) return;
      const next = moved(this.cursor.before, this.last[0].span, event.key, event.shiftKey);
      if (next === undefined) return;
      event.preventDefault();
      event.stopPropagation(); // the stage must not take this key
      this.put(next);
    });
    this.words.className = "plot-words";
    this.words.textContent = HINT;
    this.root.className = "chart";
    this.root.append(this.canvas, this.words);
  }

  draw(scene: Charted, ink: Inks): void {
    this.last = [scene, ink];
    const { data, end, span, shown } = scene;
    const width = this.canvas.clientWidth;
    if (width === 0) return;
    const c = sharpen(this.canvas, width, this.height);
    if (c === null) return;
    c.clearRect(0, 0, width, this.height);
    c.font = getComputedStyle(this.canvas).font;
    const x = linear({ low: end - span, high: end }, { low: LEFT, high: width - RIGHT });
    const read = this.cursor.before === null ? shown : end - this.cursor.before;
    const values = read === null ? null : valuesAt(data, this.lanes, read);
    let top = 0;
    this.lanes.forEach((lane, i) => {
      const columns = lane.lines.map((line) => line.column);
      const extent = data.range(columns, end - span);
      const range = follow(this.ranges[i] ?? null, withZero(extent, lane), lane.least);
      this.ranges[i] = range;
      const y = linear(range, { low: top + TOP + lane.height, high: top + TOP });
      axis(c, lane, range, y, width, top, ink);
      for (const [from, to] of gaps(data, end - span, end)) hatch(c, x(from), x(to), top + TOP, lane.height, ink);
      for (const line of lane.lines) trace(c, data, line, x, y, end - span, ink);
      if (read !== null) lane.lines.forEach((line, k) => { dot(c, x(read), y(values?.[i]?.[k] ?? Number.NaN), ink.get(line.colour)); });
      top += TOP + lane.height + GAP;
    });
    if (shown !== null) rule(c, x(shown), this.height, ink.get("--busy"), []);
    if (read !== null && read !== shown) rule(c, x(read), this.height, ink.get("--ink"), [3, 2]);
    const words = read === null || values === null ? HINT : readout(this.lanes, values, when(end - read, shown, read));
    if (this.words.textContent !== words) this.words.textContent = words;
  }

  private point(event: PointerEvent): void {
    if (this.last === null) return;
    const share = (event.offsetX - LEFT) / Math.max(1, this.canvas.clientWidth - LEFT - RIGHT);
    this.put(this.last[0].span * (1 - Math.min(1, Math.max(0, share))));
  }

  /** Put the cursor at a number of seconds before the right edge; null removes it. */
  private put(before: number | null): void {
    this.cursor.before = before;
    if (this.last === null) return;
    this.draw(...this.last);
    // Screen readers hear the values when the cursor is moved, not each time that the plot moves on under it.
    this.canvas.setAttribute("aria-valuenow", before === null ? "1" : (1 - before / this.last[0].span).toFixed(3));
    this.canvas.setAttribute("aria-valuetext", this.words.textContent);
  }
}

/** Words for the time of a cursor: before now, or relative to the moment that a replay shows. */
function when(before: number, shown: number | null, read: number): string {
  if (shown === null) return `${written(before, 2)}\u202fs ago`;
  if (read === shown) return "Here";
  return `${written(Math.abs(read - shown), 2)}\u202fs ${read < shown ? "before" : "after"}`;
}

/** Intervals of [since, now] without samples, after the first sample. */
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
