/** Definition of the lanes of a chart: their quantities, units and lines. */

import type { Range } from "../../model/scale";

export interface Line {
  /** Column of the buffer. */
  readonly column: number;
  /** Name of the custom property with the colour, or a colour. */
  readonly colour: string;
  readonly dashed?: boolean;
  /** Name of the line, written beside the lane's name if the lane has several lines. */
  readonly name?: string;
}

export interface Lane {
  readonly name: string;
  readonly unit: string;
  /** Factor from SI to the unit at the axis. */
  readonly factor: number;
  /** Least width of the scale, in SI. */
  readonly least: number;
  /** Whether the scale always contains zero. */
  readonly zero: boolean;
  readonly height: number;
  readonly lines: readonly Line[];
}

/** Longest gap between two samples over which a line is drawn; beyond it the values count as unknown [s]. */
export const UNKNOWN = 1;

/** Range that a lane shows: that of its data, with zero if the lane asks for it, and with at least its least width. */
export function withZero(extent: Range | null, lane: Pick<Lane, "zero" | "least">): Range {
  const data = extent ?? { low: 0, high: 0 };
  const low = lane.zero ? Math.min(0, data.low) : data.low;
  const high = lane.zero ? Math.max(0, data.high) : data.high;
  return { low, high: Math.max(high, low + lane.least) };
}

/** A number as text: with a true minus sign, without one on zero, and with a dash for an unknown value. */
export function written(x: number, places: number): string {
  if (!Number.isFinite(x)) return "\u2013";
  const text = x.toFixed(places);
  return Number(text) === 0 ? text.replace("-", "") : text.replace("-", "\u2212");
}
