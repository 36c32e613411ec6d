/** Back-off before the next attempt after a connection was lost. */

const FIRST = 0.5; // s
const LONGEST = 8; // s
export const LASTED = 5; // s; the end of a connection that lasted longer counts as a first failure

/**
 * Time to wait before an attempt [s]: it doubles each time, with a random part so that pages do not try in step.
 *
 * @param failures Number of failures in a row, from 1.
 * @param chance Random number from 0 to 1.
 */
export function wait(failures: number, chance: number): number {
  const longest = Math.min(LONGEST, FIRST * 2 ** (failures - 1));
  return longest * (0.5 + 0.5 * chance);
}
