/**
 * When to send a sample, so that it reaches the server just before the tick that uses it.
 *
 * `client/cohaptic_client/network/timing.py` in TypeScript.
 */

const TARGET_WAIT = 0.002; // s; margin for the jitter of two schedulers
export const WORKER_WAIT = 0.005; // s; the same where timers come every 4 ms
const GAIN = 0.1; // share of the error that one report corrects

/** Schedule of a client's samples. */
export interface Pacer {
  /** Time between samples, N T [s]. */
  readonly period: number;
  /** Time at which the next sample is to be sent [s]. */
  readonly due: number;
}

/** Schedule after a sample was sent at `now`; missed samples are left out, and the phase is kept. */
export function sent({ period, due }: Pacer, now: number): Pacer {
  const missed = Math.max(0, Math.trunc((now - due) / period));
  return { period, due: due + (missed + 1) * period };
}

/**
 * Schedule after the server has reported how long the sample that was sent at `sent_at` waited for its tick.
 *
 * @param target_wait Wait that the schedule aims at [s].
 */
export function reported({ period, due }: Pacer, sent_at: number, sample_wait: number, target_wait = TARGET_WAIT): Pacer {
  const right = sent_at + sample_wait - Math.min(target_wait, 0.5 * period);
  // The correction goes the shorter way, earlier or later, because only the phase matters.
  const around = (right - due + 0.5 * period) % period;
  const error = (around < 0 ? around + period : around) - 0.5 * period;
  return { period, due: due + GAIN * error };
}
