/** A cursor that reads values in plots: its position, the values there, and its keys. */

import { type Lane, UNKNOWN, written } from "./lanes";
import type { TraceBuffer } from "./trace_buffer";

const FINE = 0.05; // s for an arrow key
const COARSE = 0.5; // s for an arrow key with Shift

/** Position of a cursor that plots over one time axis share: seconds before their right edge; null for no cursor. */
export interface PlotCursor {
  before: number | null;
}

/** Position to which a key moves the cursor; undefined for a key that does not belong to the cursor. */
export function moved(before: number | null, span: number, key: string, shift: boolean): number | null | undefined {
  const step = shift ? COARSE : FINE;
  const from = before ?? 0.5 * span;
  const to: Readonly<Record<string, number>> = {
    ArrowLeft: from + step, ArrowDown: from + step, ArrowRight: from - step, ArrowUp: from - step,
    PageDown: from + COARSE, PageUp: from - COARSE, Home: span, End: 0,
  };
  if (key === "Escape") return before === null ? undefined : null;
  const next = to[key];
  return next === undefined ? undefined : Math.min(span, Math.max(0, next));
}

/** The newest value not after `t` of each line of each lane; NaN where nothing is known. */
export function valuesAt(data: TraceBuffer, lanes: readonly Lane[], t: number): number[][] {
  return lanes.map(({ lines }) => lines.map(({ column }) => {
    let [time, found] = [-Infinity, Number.NaN];
    data.each(column, t - UNKNOWN, (at, value) => {
      if (at <= t) [time, found] = [at, value];
    });
    return t - time > UNKNOWN ? Number.NaN : found;
  }));
}

/** The values in words, with their units: "1.20 s ago: proxy 12.1 mm, probe 14.0 mm, force 1.23 N". */
export function readout(lanes: readonly Lane[], values: readonly (readonly number[])[], when: string): string {
  const parts = lanes.flatMap((lane, i) => lane.lines.map((line, k) => {
    const value = values[i]?.[k] ?? Number.NaN;
    const places = lane.unit === "ms" ? 0 : lane.unit === "mm" ? 1 : 2;
    return `${line.name ?? lane.name} ${written(lane.factor * value, places)}${Number.isNaN(value) ? "" : `\u202f${lane.unit}`}`;
  }));
  return `${when}: ${parts.join(", ")}`;
}
