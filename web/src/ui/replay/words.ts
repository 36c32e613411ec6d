/** Words of a replay: the age of the shown time, and the delay and the error in position of each hand. */

import { fixed, milliseconds, millimetres, named } from "../words";

/** Words for an age [s]. */
export function ago(seconds: number): string {
  return `${fixed(Math.max(0, seconds), seconds < 100 ? 1 : 0)}\u202fs ago`;
}

/** A time within a session as people write it: minutes, seconds and tenths. */
export function clockTime(seconds: number): string {
  const tenths = Math.max(0, Math.round(10 * seconds));
  const [minutes, rest] = [Math.floor(tenths / 600), tenths % 600];
  return `${minutes}:${(rest / 10).toFixed(1).padStart(4, "0")}`;
}

export interface Late {
  readonly name: string;
  /** Delay of the hand [s]. */
  readonly late: number;
  /** Distance between the hand's true position and the drawn one [m]. */
  readonly apart: number;
}

/**
 * Words on the meaning of the outlines, with the numbers.
 *
 * @param hands Hands that have an outline.
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
