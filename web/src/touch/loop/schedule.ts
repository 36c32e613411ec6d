/** Haptic periods in batches: a Worker wakes every few milliseconds and runs as many as have passed. */

export const HAPTIC_PERIOD = 0.001; // s, T
const MOST_AT_ONCE = 20; // periods run in one wake; further periods of a longer stall are lost

/** Time schedule of the loop. */
export interface Schedule {
  /** Time at which the next period is due [s]. */
  readonly next: number;
  /** Periods that were left out since the start. */
  readonly missed: number;
}

/** The times of the periods to run at `now` [s], and the schedule after them. */
export function due({ next, missed }: Schedule, now: number): [times: readonly number[], after: Schedule] {
  const passed = Math.max(0, Math.floor((now - next) / HAPTIC_PERIOD + 1e-6) + 1);
  const lost = Math.max(0, passed - MOST_AT_ONCE);
  const first = next + lost * HAPTIC_PERIOD;
  const count = passed - lost;
  const times = Array.from({ length: count }, (_, i) => first + i * HAPTIC_PERIOD);
  return [times, { next: first + count * HAPTIC_PERIOD, missed: missed + lost }];
}
