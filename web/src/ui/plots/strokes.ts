/** Drawing of the parts of a chart: axis, names, lines, unknown intervals, and the cursor. */

import { digits, type Range, ticks } from "../../model/scale";
import type { Inks } from "./canvas";
import { type Lane, type Line, UNKNOWN } from "./lanes";
import type { TraceBuffer } from "./trace_buffer";

/** Margins of a chart, and of each of its lanes [px]. */
export const LEFT = 34;
export const RIGHT = 6;
export const TOP = 15;
export const GAP = 9;
/** Piece of a line before its name, and the gap to the name before that; there is room for two beside the lane's name [px]. */
export const PIECE = 10;
export const BETWEEN = 8;
const HATCH = 6; // px between two lines of the hatching

/** Draw slanted lines over an unknown interval. */
export function hatch(c: CanvasRenderingContext2D, left: number, right: number, top: number, height: number, ink: Inks): void {
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

export function axis(
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

/** Draw the names of several lines, each after a piece of its line, from the right. */
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
    c.moveTo(right - 4 - PIECE, top + 6);
    c.lineTo(right - 4, top + 6);
    c.stroke();
    c.setLineDash([]);
    right -= 4 + PIECE + BETWEEN;
  }
}

export function trace(
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

export function rule(c: CanvasRenderingContext2D, x: number, height: number, colour: string, dash: number[]): void {
  c.strokeStyle = colour;
  c.lineWidth = 1.2;
  c.setLineDash(dash);
  c.beginPath();
  c.moveTo(x, TOP);
  c.lineTo(x, height - GAP);
  c.stroke();
  c.setLineDash([]);
}

export function dot(c: CanvasRenderingContext2D, x: number, y: number, colour: string): void {
  if (Number.isNaN(y)) return;
  c.fillStyle = colour;
  c.beginPath();
  c.arc(x, y, 2.6, 0, 2 * Math.PI);
  c.fill();
}
