/** Size and frequency of a force's swing, by which the tour's claims are measured. */

/** Swing of a force over some seconds. */
export interface Swing {
  /** Difference between the largest and the least value [N]. */
  readonly size: number;
  /** Full swings per second; 0 if the force does not swing back [Hz]. */
  readonly hz: number;
}

/** Size from which on a force is said to swing [N]; a fingertip feels a tenth of it. */
export const SWINGS = 0.5;
/** Size below which a force is said to be at rest [N]; a finger does not feel so little. */
export const RESTS = 0.02;
const DEAD = 0.15; // share of the size on each side of the middle in which crossings are not counted, because noise is no swing

/**
 * @param times Times of the samples [s], rising.
 * @param forces Samples of the force [N].
 * @returns The swing; null for fewer than two samples.
 */
export function swingOf(times: readonly number[], forces: readonly number[]): Swing | null {
  const [first, last] = [times[0], times.at(-1)];
  if (times.length < 2 || first === undefined || last === undefined || !(last > first)) return null;
  const low = Math.min(...forces);
  const high = Math.max(...forces);
  const middle = 0.5 * (low + high);
  const dead = DEAD * (high - low);
  let below = false;
  const ups: number[] = [];
  forces.forEach((force, i) => {
    if (force < middle - dead) below = true;
    if (below && force > middle + dead) {
      below = false;
      ups.push(times[i] ?? 0);
    }
  });
  const whole = (ups.at(-1) ?? 0) - (ups[0] ?? 0);
  return { size: high - low, hz: whole > 0 ? (ups.length - 1) / whole : 0 };
}
