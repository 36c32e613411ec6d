/** A cursor that reads values in plots: where it is, what stands there, and what its keys do. */

import { type Lane, UNKNOWN, written } from "./lanes";
import type { TraceBuffer } from "./trace_buffer";

const FINE = 0.05; // s for an arrow key
const COARSE = 0.5; // s for one with Shift

/** Shared by plots over one time axis: seconds before their right edge; null while it is nowhere. */
export interface PlotCursor {
  before: number | null;
}

/** Where a key brings the cursor; undefined for a key that is none of its. */
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

/** The newest sample that is not after `t`, of each line of each lane; nan where nothing is known. */
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
