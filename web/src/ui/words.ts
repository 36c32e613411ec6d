/** Numbers and names as people read them; millimetres and milliseconds are made here. */

import type { LawName } from "../types";

const MINUS = "\u2212";
const THIN = "\u202f";

/** With `places` digits, a true minus, and no minus on nothing. */
export function fixed(x: number, places: number): string {
  if (!Number.isFinite(x)) return "\u2013";
  const text = x.toFixed(places);
  return Number(text) === 0 ? text.replace("-", "") : text.replace("-", MINUS);
}

export const newtons = (f: number): string => `${fixed(f, 2)}${THIN}N`;
export const millimetres = (x: number, places = 1): string => `${fixed(1e3 * x, places)}${THIN}mm`;
export const milliseconds = (t: number): string => `${fixed(1e3 * t, 0)}${THIN}ms`;

/** Stiffness with three digits. */
export function stiffness(k: number): string {
  if (!(k > 0) || !Number.isFinite(k)) return "\u2013";
  return k >= 1e4 ? `${fixed(k / 1e3, 0)}${THIN}N/mm` : `${fixed(k, k >= 100 ? 0 : 1)}${THIN}N/m`;
}

export function bytesPerSecond(b: number): string {
  return b < 1000 ? `${fixed(b, 0)}${THIN}B/s` : `${fixed(b / 1000, b < 1e4 ? 1 : 0)}${THIN}kB/s`;
}

export const LAWS: Readonly<Record<LawName, string>> = {
  predictive: "Predictive",
  pi: "PI",
  proportional: "Proportional",
};
