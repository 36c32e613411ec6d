/** What the lanes of a chart are: their quantities, units and lines. */

import type { Range } from "../../model/scale";

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

/** Longer between two samples, and nothing is known of what was between [s]. */
export const UNKNOWN = 1;

/** The range that a lane shows: its data with zero, and no less than its least width. */
export function withZero(extent: Range | null, lane: Pick<Lane, "zero" | "least">): Range {
  const data = extent ?? { low: 0, high: 0 };
  const low = lane.zero ? Math.min(0, data.low) : data.low;
  const high = lane.zero ? Math.max(0, data.high) : data.high;
  return { low, high: Math.max(high, low + lane.least) };
}

/** A number as people read it: with a true minus, none on nothing, and a dash for what is not known. */
export function written(x: number, places: number): string {
  if (!Number.isFinite(x)) return "\u2013";
  const text = x.toFixed(places);
  return Number(text) === 0 ? text.replace("-", "") : text.replace("-", "\u2212");
}
