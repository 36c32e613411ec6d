/**
 * Round trip, jitter and clock offset of a link, estimated from every patch;
 * `client/cohaptic_client/network/timing.py` in TypeScript.
 *
 * A patch sends back when its sample left (`t_client`), how long the sample waited for the tick (`sample_wait`) and when
 * the tick was (`t_server`), as in NTP. The clock offset is that of the shortest recent round trip.
 */

const WINDOW = 5; // s; the shortest round trip counts for at least this long and at most twice that
const SMOOTHING = 0.05; // share of a new round trip in the running means

/** One passage to the server and back. */
export interface Passage {
  /** Round trip without the wait at the server [s]. */
  readonly round_trip: number;
  /** Server's clock less the client's, if both ways took equally long [s]. */
  readonly offset: number;
}

/** Estimated timing of a link. */
export interface LinkTiming {
  /** Running mean of the round trips [s]; 0 before the first patch. */
  readonly round_trip: number;
  /** Running mean of the deviation from the mean round trip [s]. */
  readonly jitter: number;
  /** Shortest passage of the present window; null before the first patch. */
  readonly shortest: Passage | null;
  readonly shortest_before: Passage | null;
  /** End of the present window, on the client's clock [s]. */
  readonly until: number;
}

export const UNTIMED: LinkTiming = { round_trip: 0, jitter: 0, shortest: null, shortest_before: null, until: 0 };

/** Server's clock less the client's [s]; 0 before the first patch. */
export function clockOffset({ shortest: a, shortest_before: b }: LinkTiming): number {
  if (a === null) return 0;
  return b !== null && b.round_trip < a.round_trip ? b.offset : a.offset;
}

/**
 * The shortest recent round trip, which is that of the network alone, because all other delays come and go [s];
 * null before the first patch.
 */
export function shortestTrip({ shortest: a, shortest_before: b }: LinkTiming): number | null {
  return a === null ? null : Math.min(a.round_trip, b?.round_trip ?? Infinity);
}

/** Of a patch: the number of its tick, and when that was [s, server's clock]. */
export interface Ticked {
  readonly tick: number;
  readonly t_server: number;
}

/** By how much the second tick came later after the first than the rate of ticks says [s]; 0 without a first. */
export function tickLate(before: Ticked | null, now: Ticked, period: number): number {
  return before === null ? 0 : Math.max(0, now.t_server - before.t_server - (now.tick - before.tick) * period);
}

/** Timing after a patch that came at `now`. */
export function measured(
  timing: LinkTiming,
  patch: { readonly t_client: number; readonly t_server: number; readonly sample_wait: number },
  now: number,
): LinkTiming {
  const trip = Math.max(0, now - patch.t_client - patch.sample_wait);
  const arrived = patch.t_server - patch.sample_wait;
  const passage = { round_trip: trip, offset: 0.5 * (arrived - patch.t_client + (patch.t_server - now)) };
  if (timing.shortest === null) {
    return { round_trip: trip, jitter: 0, shortest: passage, shortest_before: null, until: now + WINDOW };
  }
  const round_trip = timing.round_trip + SMOOTHING * (trip - timing.round_trip);
  const jitter = timing.jitter + SMOOTHING * (Math.abs(trip - round_trip) - timing.jitter);
  if (now >= timing.until) {
    return { round_trip, jitter, shortest: passage, shortest_before: timing.shortest, until: now + WINDOW };
  }
  const shortest = trip < timing.shortest.round_trip ? passage : timing.shortest;
  return { ...timing, round_trip, jitter, shortest };
}
