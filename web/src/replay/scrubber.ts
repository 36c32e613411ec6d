/** Where a replay is, as values: what each control does is a function from one state to the next. */

/** Shares of the pace of life at which a replay may run. */
export const SPEEDS = [1, 0.25, 0.1] as const;
export type Speed = (typeof SPEEDS)[number];

/** A page that slept does not run through all that it missed: a replay goes on by no more than this in a picture [s]. */
const LONGEST_STEP = 0.25;

export interface Scrubber {
  /** The time that is shown, on the server's clock [s]. */
  readonly t: number;
  /** Of the recording [s]. */
  readonly from: number;
  readonly to: number;
  readonly speed: Speed;
  readonly playing: boolean;
}

/** At the end, where it was paused. */
export function begin(times: Float64Array): Scrubber {
  const to = times.at(-1) ?? 0;
  return { t: to, from: times[0] ?? to, to, speed: 1, playing: false };
}

/** To a time, as near as the recording has it. */
export function seek(s: Scrubber, t: number): Scrubber {
  return Number.isNaN(t) ? s : { ...s, t: Math.min(s.to, Math.max(s.from, t)) };
}

/** On by `dt` of the clock on the wall [s]; at the end it stands. */
export function advance(s: Scrubber, dt: number): Scrubber {
  if (!s.playing) return s;
  const t = s.t + s.speed * Math.min(LONGEST_STEP, Math.max(0, dt));
  return t < s.to ? { ...s, t } : { ...s, t: s.to, playing: false };
}

/** On, or still; from its end it begins anew. */
export function play(s: Scrubber, playing: boolean): Scrubber {
  return playing && s.t >= s.to ? { ...s, t: s.from, playing } : { ...s, playing };
}

export function pace(s: Scrubber, speed: Speed): Scrubber {
  return { ...s, speed };
}

/** To the frame after the shown time, or before it, and still. */
export function step(s: Scrubber, times: Float64Array, by: 1 | -1): Scrubber {
  const here = lastBefore(times, s.t);
  // Between two frames the one before is half a step back.
  const on = by > 0 ? here + 1 : times[here] === s.t ? here - 1 : here;
  return { ...seek(s, times[Math.min(times.length - 1, Math.max(0, on))] ?? s.t), playing: false };
}

/** Number of the last time that is not after `t`; -1 for none. `times` rises. */
export function lastBefore(times: Float64Array, t: number): number {
  let [low, high] = [0, times.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if ((times[middle] ?? Infinity) <= t) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}
