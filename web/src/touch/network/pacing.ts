/**
 * When to send a sample, so that it reaches the server just before the tick that uses it.
 *
 * `client/cohaptic_client/network/pacing.py` in TypeScript.
 */

const TARGET_WAIT = 0.002; // s; room for the jitter of two schedulers
export const WORKER_WAIT = 0.005; // s; the same where timers come every 4 ms
const GAIN = 0.1; // share of the error that one report corrects

/** Schedule of a client's samples. */
export interface Pacer {
  /** Between samples, N T [s]. */
  readonly period: number;
  /** When the next sample is to be sent [s]. */
  readonly due: number;
}

/** A sample was sent at `now`; missed ones are left out, the phase is kept. */
export function sent({ period, due }: Pacer, now: number): Pacer {
  const missed = Math.max(0, Math.trunc((now - due) / period));
  return { period, due: due + (missed + 1) * period };
}

/**
 * The server reports how long the sample that was sent at `sent_at` waited for its tick.
 *
 * @param target_wait How long it should [s].
 */
export function reported({ period, due }: Pacer, sent_at: number, sample_wait: number, target_wait = TARGET_WAIT): Pacer {
  const right = sent_at + sample_wait - Math.min(target_wait, 0.5 * period);
  // Earlier or later, whichever is nearer: the phase counts, not the period.
  const around = (right - due + 0.5 * period) % period;
  const error = (around < 0 ? around + period : around) - 0.5 * period;
  return { period, due: due + GAIN * error };
}
