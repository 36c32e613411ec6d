/** The time that is left of a phase, by the rate of its share so far; `cohaptic_server/progress.py` in TypeScript. */

const SOON = 2; // s until the rate is known well enough

export class TimeLeft {
  private phase = "";
  private began = 0;

  /**
   * Time left of the phase [s]; null while nothing is known.
   *
   * @param phase Its name; a new one begins anew.
   * @param share Of it that is done, 0 to 1.
   * @param now [s]
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

/** "about 20 s left"; in steps that one can read, so that it does not flicker. */
export function leftWords(seconds: number | null): string {
  if (seconds === null) return "";
  if (seconds < 5) return "a few seconds left";
  if (seconds < 55) return `about ${5 * Math.ceil(seconds / 5)} s left`;
  return `about ${Math.ceil(seconds / 60)} min left`;
}
