/** Haptic periods in batches: a Worker wakes every few milliseconds and runs as many as have passed. */

export const HAPTIC_PERIOD = 0.001; // s, T
const MOST_AT_ONCE = 20; // periods run in one wake; further periods of a longer stall are lost

/** The times of the periods to run at `now` [s], and when the one after them is due; `next` is when the first was. */
export function due(next: number, now: number): [times: readonly number[], next: number] {
  const passed = Math.max(0, Math.floor((now - next) / HAPTIC_PERIOD + 1e-6) + 1);
  const count = Math.min(passed, MOST_AT_ONCE);
  const first = next + (passed - count) * HAPTIC_PERIOD;
  const times = Array.from({ length: count }, (_, i) => first + i * HAPTIC_PERIOD);
  return [times, first + count * HAPTIC_PERIOD];
}
