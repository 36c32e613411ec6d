/** How much a force swings, and how often: what the tour's claims are measured by. */

/** Of a force over some seconds. */
export interface Swing {
  /** From its least to its largest value [N]. */
  readonly size: number;
  /** Full swings in a second; 0 where it does not come back [Hz]. */
  readonly hz: number;
}

/** A force that swings by so much is said to swing [N]: a tenth of it is felt at a fingertip. */
export const SWINGS = 0.5;
/** A force that swings by less is said to rest [N]: it is less than a finger feels. */
export const RESTS = 0.02;
const DEAD = 0.15; // share of the size, each side of the middle, in which nothing is counted: noise is no swing

/**
 * @param times Of the samples [s], rising.
 * @param forces [N]
 * @returns Null of fewer than two samples.
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
