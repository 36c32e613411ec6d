/** When to try again after a connection was lost. */

const FIRST = 0.5; // s
const LONGEST = 8; // s
export const LASTED = 5; // s; a connection that lasted so long was a good one: its end counts as the first

/**
 * Time to wait before an attempt [s]: twice as long each time, and not in step with everybody else's.
 *
 * @param failures In a row, from 1.
 * @param chance From 0 to 1, at random.
 */
export function wait(failures: number, chance: number): number {
  const longest = Math.min(LONGEST, FIRST * 2 ** (failures - 1));
  return longest * (0.5 + 0.5 * chance);
}
