/** Measures how long messages wait for the page, which draws and does all its other work in one thread. */

const WINDOW = 4; // s; a wait counts for at least this long and at most twice that, as a loop's delay does at the server

export class PageWait {
  private recent = 0;
  private before = 0;
  private until = -Infinity;

  /** Longest recent wait [s]. */
  get longest(): number {
    return Math.max(this.recent, this.before);
  }

  /** Count a message that was sent at `sent` and read at `now` [s]. */
  heard(sent: number, now: number): void {
    if (now >= this.until) {
      // After a pause without messages the former window is long past.
      this.before = now < this.until + WINDOW ? this.recent : 0;
      [this.recent, this.until] = [0, now + WINDOW];
    }
    this.recent = Math.max(this.recent, now - sent);
  }
}
