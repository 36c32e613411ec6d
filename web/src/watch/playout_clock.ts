/**
 * Time at which a frame is shown, from the offset of the clocks and a lag behind the newest frame.
 *
 * The fastest recent frame gives the clocks' offset, and the slowest recent one the lag that leaves two frames to
 * interpolate between; the shown time is `now - lag` on the server's clock. The lag changes slowly, so that the shown time
 * runs at most a tenth faster or slower than real time. (Measured one way only, the offset includes the least delay of that
 * way, which cannot be separated and does not matter for the display.)
 */

const WINDOW = 4; // s; a frame counts for at least this long and at most twice that
const BEGINNING = 1; // s; length of the first window: frames that came while the page was still starting soon do not count
const SLEW = 0.1; // s of lag per s
const MARGIN = 0.003; // s; margin, as a display does not draw at the very moment at which a frame comes
const MOST_LATE = 0.5; // s; a frame that is later counts as this: a single stall must not delay the display for ever

interface Span {
  /** Least value of now - t_server [s]; `most` is the largest. */
  readonly least: number;
  readonly largest: number;
}

/** Estimated delay from the server to the screen. */
export interface PlayoutClock {
  readonly recent: Span;
  readonly before: Span | null;
  /** End of the present window, page's clock [s]. */
  readonly until: number;
  /** Whether the present window is the first. */
  readonly beginning: boolean;
  /** Page's clock less the time that is shown [s]. */
  readonly lag: number;
  /** Arrival of the newest frame, on the page's clock [s]. */
  readonly at: number;
}

/** Clock after the first frame of a connection. */
export function firstFrame(t_server: number, now: number, interval: number): PlayoutClock {
  const age = now - t_server;
  const recent = { least: age, largest: age };
  return { recent, before: null, until: now + BEGINNING, beginning: true, lag: age + interval + MARGIN, at: now };
}

/**
 * Clock after another frame.
 *
 * @param interval Time between frames [s].
 */
export function nextFrame(clock: PlayoutClock, t_server: number, now: number, interval: number): PlayoutClock {
  const age = now - t_server;
  const over = now >= clock.until;
  const recent = over
    ? { least: age, largest: age }
    : { least: Math.min(clock.recent.least, age), largest: Math.max(clock.recent.largest, age) };
  // After a pause without frames the former window is long past.
  const outdated = clock.beginning || now >= clock.until + WINDOW;
  const before = over ? (outdated ? null : clock.recent) : clock.before;
  const least = Math.min(recent.least, before?.least ?? Infinity);
  const largest = Math.max(recent.largest, before?.largest ?? -Infinity);
  const target = least + Math.min(largest - least, MOST_LATE) + interval + MARGIN;
  const most = SLEW * (now - clock.at);
  const lag = clock.lag + Math.min(Math.max(target - clock.lag, -most), most);
  const until = over ? now + WINDOW : clock.until;
  return { recent, before, until, beginning: clock.beginning && !over, lag, at: now };
}

/** Delay of the display after the earliest time at which the fastest frame could be shown [s]. */
export function playoutDelay({ recent, before, lag }: PlayoutClock): number {
  return lag - Math.min(recent.least, before?.least ?? Infinity);
}

/** Time between the frames of a server, which sends only after ticks [s]. */
export function frameInterval(rate: number, simulation_period: number): number {
  return Math.max(1, Math.ceil(1 / (rate * simulation_period) - 1e-6)) * simulation_period;
}
