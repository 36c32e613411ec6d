/** Words of a replay: how long ago, and how late and how far off each hand is. */

import { fixed, milliseconds, millimetres, named } from "../words";

/** How long before now [s]. */
export function ago(seconds: number): string {
  return `${fixed(Math.max(0, seconds), seconds < 100 ? 1 : 0)}\u202fs ago`;
}

export interface Late {
  readonly name: string;
  /** [s] */
  readonly late: number;
  /** [m] */
  readonly apart: number;
}

/**
 * What the outlines mean, and by how much.
 *
 * @param hands Those that have one.
 */
export function delayWords(replaying: boolean, hands: readonly Late[]): string {
  const numbers = hands.map(({ name, late, apart }) => `${named(name)} ${milliseconds(late)}, ${millimetres(apart)}`).join(" \u00b7 ");
  if (replaying) {
    return hands.length === 0
      ? "No hand of this moment has a measured delay."
      : `Solid: what had arrived. Outlined: where the hand itself was. ${numbers}`;
  }
  return hands.length === 0
    ? "Touch, and an outline shows where everybody else has your hand. Of the others only a replay knows."
    : `Solid: your hand now. Outlined: where everybody else has it. ${numbers}`;
}
