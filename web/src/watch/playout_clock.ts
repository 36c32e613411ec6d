/**
 * When a frame is shown: the server's clock against the page's, and how far behind the newest frame to stay.
 *
 * The fastest frame of late gives the clocks' offset, the latest one the time that is needed between two frames; the
 * shown time is `now - lag` on the server's clock. The lag moves slowly, so that shown time runs at most a tenth faster
 * or slower than real time. (One way only, the offset holds the way's least delay: it cannot be told apart, and does
 * not matter for the display.)
 */

const WINDOW = 4; // s; a frame counts for at least this long and at most twice that
const BEGINNING = 1; // s; frames that came while the page was busy starting count no longer
const SLEW = 0.1; // s of lag per s
const MARGIN = 0.003; // s; a display does not ask at the moment that a frame comes
const MOST_LATE = 0.5; // s; a stall of the network is a stall, not a reason to show the past for ever

interface Span {
  /** Least and largest of now - t_server [s]. */
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
  /** Arrival of the newest frame, page's clock [s]. */
  readonly at: number;
}

/** The first frame of a connection came. */
export function firstFrame(t_server: number, now: number, interval: number): PlayoutClock {
  const age = now - t_server;
  const recent = { least: age, largest: age };
  return { recent, before: null, until: now + BEGINNING, beginning: true, lag: age + interval + MARGIN, at: now };
}

/**
 * Another frame came.
 *
 * @param interval Between frames [s].
 */
export function nextFrame(clock: PlayoutClock, t_server: number, now: number, interval: number): PlayoutClock {
  const age = now - t_server;
  const over = now >= clock.until;
  const recent = over
    ? { least: age, largest: age }
    : { least: Math.min(clock.recent.least, age), largest: Math.max(clock.recent.largest, age) };
  // After a pause in which nothing changed, the window before is long past.
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

/** How late frames are shown after the fastest could be [s]. */
export function playoutDelay({ recent, before, lag }: PlayoutClock): number {
  return lag - Math.min(recent.least, before?.least ?? Infinity);
}

/** Time between the frames of a server that sends after ticks only [s]. */
export function frameInterval(rate: number, simulation_period: number): number {
  return Math.max(1, Math.ceil(1 / (rate * simulation_period) - 1e-6)) * simulation_period;
}
