/** Estimates the time left of a phase from its rate so far; `cohaptic_server/progress.py` in TypeScript. */

const SOON = 2; // s until the rate is known well enough

export class TimeLeft {
  private phase = "";
  private began = 0;

  /**
   * Time left of the phase [s]; null while nothing is known.
   *
   * @param phase Name of the phase; a new name begins a new estimate.
   * @param share Share of the phase that is done, 0 to 1.
   * @param now Time [s].
   */
  seconds(phase: string, share: number, now: number): number | null {
    if (phase !== this.phase) {
      this.phase = phase;
      this.began = now;
    }
    const spent = now - this.began;
    return share <= 0 || spent < SOON ? null : (spent * Math.max(0, 1 - share)) / share;
  }
}

/** Words such as "about 20 s left", in steps that are coarse enough not to flicker. */
export function leftWords(seconds: number | null): string {
  if (seconds === null) return "";
  if (seconds < 5) return "a few seconds left";
  if (seconds < 55) return `about ${5 * Math.ceil(seconds / 5)} s left`;
  return `about ${Math.ceil(seconds / 60)} min left`;
}
