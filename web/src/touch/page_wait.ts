/** How long messages wait for the page, which draws and does all else one after the other. */

const WINDOW = 4; // s; a wait counts for at least this long and at most twice that, as a loop's delay does at the server

export class PageWait {
  private recent = 0;
  private before = 0;
  private until = -Infinity;

  /** The longest of late [s]. */
  get longest(): number {
    return Math.max(this.recent, this.before);
  }

  /** A message that was sent at `sent` is read at `now` [s]. */
  heard(sent: number, now: number): void {
    if (now >= this.until) {
      // After a pause in which nothing was heard, the window before is long past.
      this.before = now < this.until + WINDOW ? this.recent : 0;
      [this.recent, this.until] = [0, now + WINDOW];
    }
    this.recent = Math.max(this.recent, now - sent);
  }
}
