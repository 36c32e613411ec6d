/** State of a replay as values: each control is a function from one state to the next. */

/** Speeds of a replay as shares of real time: of the last minute, and of a recorded session. */
export const SPEEDS = [1, 0.25, 0.1] as const;
export const SESSION_SPEEDS = [0.1, 0.25, 1, 2, 5, 10] as const;
export type Speed = (typeof SPEEDS)[number] | (typeof SESSION_SPEEDS)[number];

/** Longest step of a replay in one picture, so that a page that slept does not run through all that it missed [s]. */
const LONGEST_STEP = 0.25;

export interface Scrubber {
  /** The time that is shown, on the server's clock [s]. */
  readonly t: number;
  /** First and last time of the recording [s]. */
  readonly from: number;
  readonly to: number;
  readonly speed: Speed;
  readonly playing: boolean;
}

/** State at the end of the recording, where the visitor paused. */
export function begin(times: Float64Array): Scrubber {
  const to = times.at(-1) ?? 0;
  return { t: to, from: times[0] ?? to, to, speed: 1, playing: false };
}

/** Go to a time, limited to the recording. */
export function seek(s: Scrubber, t: number): Scrubber {
  return Number.isNaN(t) ? s : { ...s, t: Math.min(s.to, Math.max(s.from, t)) };
}

/** Advance by `dt` of real time [s]; the replay stops at the end. */
export function advance(s: Scrubber, dt: number): Scrubber {
  if (!s.playing) return s;
  const t = s.t + s.speed * Math.min(LONGEST_STEP, Math.max(0, dt));
  return t < s.to ? { ...s, t } : { ...s, t: s.to, playing: false };
}

/** Play or pause; playing at the end begins anew. */
export function play(s: Scrubber, playing: boolean): Scrubber {
  return playing && s.t >= s.to ? { ...s, t: s.from, playing } : { ...s, playing };
}

export function pace(s: Scrubber, speed: Speed): Scrubber {
  return { ...s, speed };
}

/** Go to the next or the previous frame, and pause. */
export function step(s: Scrubber, times: Float64Array, by: 1 | -1): Scrubber {
  const here = lastBefore(times, s.t);
  // Between two frames a step back goes to the frame just before.
  const on = by > 0 ? here + 1 : times[here] === s.t ? here - 1 : here;
  return { ...seek(s, times[Math.min(times.length - 1, Math.max(0, on))] ?? s.t), playing: false };
}

/** Time after a moment within which a step back goes to the one before, as far as speed 1 goes meanwhile [s]. */
const JUST_NOW = 0.7;

/** The next moment, or the one before; null where there is none. */
export function moment<M extends { readonly t: number }>(s: Scrubber, moments: readonly M[], by: 1 | -1): M | null {
  if (by > 0) return moments.find(({ t }) => t > s.t) ?? null;
  const before = s.t - (s.playing ? JUST_NOW * s.speed : 0);
  return moments.findLast(({ t }) => t < before) ?? null;
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
