/** Notices that the page did not run for a while: a tab in the background, a laptop asleep. */

const HIDDEN = 3; // s in the background after which a notice is given
const GAP = 15; // s without a frame although the page is visible: the machine slept
const TELL = 8; // s for which the notice stays
const SETTLED = 10; // frames after which the start of the page is over

export class SleepDetector {
  private last: number | null = null;
  private slept = 0;
  private until = 0;
  private frames = 0;
  private hidden = false;

  /** The tab went to the background. */
  hide(): void {
    this.hidden = true;
  }

  /** A frame is drawn at `now` [s]; returns how long the page slept if it has just woken [s]. */
  frame(now: number): number {
    const gap = this.last === null ? 0 : now - this.last;
    this.last = now;
    this.frames += 1;
    // The first frames prepare the graphics, which can take seconds and is no pause.
    const least = this.hidden ? HIDDEN : GAP;
    this.hidden = false;
    if (gap <= least || this.frames < SETTLED) return 0;
    this.slept = gap;
    this.until = now + TELL;
    return gap;
  }

  /** Length of a pause that ended shortly before `now`, 0 for none [s]. */
  told(now: number): number {
    return now < this.until ? this.slept : 0;
  }
}
