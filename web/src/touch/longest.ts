/** The longest of recent times: how long a message waited, a loop stood still, a tick was late. */

const WINDOW = 4; // s; a time counts for at least this long and at most twice that, as a loop's delay does at the server

export class Longest {
  private recent = 0;
  private before = 0;
  private until = -Infinity;

  /** Longest recent time [s]; 0 before the first. */
  get value(): number {
    return Math.max(this.recent, this.before);
  }

  /** Count a time of `seconds` that ended at `now` [s]. */
  note(seconds: number, now: number): void {
    if (now >= this.until) {
      // After a pause in which nothing was noted the former window is long past.
      this.before = now < this.until + WINDOW ? this.recent : 0;
      [this.recent, this.until] = [0, now + WINDOW];
    }
    this.recent = Math.max(this.recent, seconds);
  }
}
