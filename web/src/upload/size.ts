/** The size of an object: the unit of its file, and the resulting lengths in words. */

import type { Vec3 } from "../model/vec";

export type Unit = "mm" | "cm" | "m" | "inch";

/** Length of each unit [m]. */
export const UNITS: Readonly<Record<Unit, number>> = { mm: 1e-3, cm: 1e-2, m: 1, inch: 0.0254 };
/** Limits of the longest side of an object for the server [m]. */
export const SMALLEST = 0.005;
export const LARGEST = 5;
/** Length of a hand, from the wrist to the tip of the middle finger [m]: mean of women and men, 17.3 and 18.9 cm. */
export const HAND = 0.18;

/** Familiar things and their lengths [m]. */
const FAMILIAR: readonly (readonly [number, string])[] = [
  [0.008, "a pea"],
  [0.016, "the tip of a finger"],
  [0.035, "a walnut"],
  [0.075, "an apple"],
  [HAND, "a hand"],
  [0.45, "a forearm with its hand"],
  [1.7, "a person"],
  [4, "a car"],
];

/** The unit that a scale stands for; null for any other scale. */
export function unitOf(scale: number): Unit | null {
  const names = Object.keys(UNITS) as Unit[];
  return names.find((unit) => Math.abs(scale / UNITS[unit] - 1) < 1e-6) ?? null;
}

/** A length with two digits, in its usual unit: "12 mm", "3.4 cm", "1.2 m". */
export function lengthWords(metres: number): string {
  const [factor, unit] = metres < 0.01 ? [1e3, "mm"] : metres < 1 ? [1e2, "cm"] : [1, "m"];
  return `${Number((factor * metres).toPrecision(2))} ${unit}`;
}

/** Words on a size, such as "18 x 9.0 x 4.2 cm long, about as long as a hand"; they say if it is too small or too large. */
export function sizeWords(sides: Vec3): string {
  const longest = Math.max(...sides);
  const [factor, unit] = longest < 0.01 ? [1e3, "mm"] : longest < 1 ? [1e2, "cm"] : [1, "m"];
  const all = [...sides].sort((a, b) => b - a).map((side) => Number((factor * side).toPrecision(2)));
  const size = `${all.join(" \u00d7 ")} ${unit}`;
  if (longest < SMALLEST * (1 - 1e-6)) return `${size}: too small to be touched, at least ${lengthWords(SMALLEST)}`;
  if (longest > LARGEST * (1 + 1e-6)) return `${size}: too large to be touched, at most ${lengthWords(LARGEST)}`;
  return `${size}, ${likeness(longest)}`;
}

/** Whether the server takes an object whose longest side is this [m]. */
export function touchable(longest: number): boolean {
  return longest >= SMALLEST * (1 - 1e-6) && longest <= LARGEST * (1 + 1e-6);
}

function likeness(longest: number): string {
  const away = (length: number): number => Math.abs(Math.log(longest / length));
  const [length, name] = FAMILIAR.reduce((best, one) => (away(one[0]) < away(best[0]) ? one : best));
  const ratio = longest / length;
  return `${ratio > 1.2 ? "longer than" : ratio < 0.83 ? "shorter than" : "about as long as"} ${name}`;
}
