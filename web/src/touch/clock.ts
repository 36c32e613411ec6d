/**
 * Makes a clock even that goes in steps, by counting timers between two steps.
 *
 * Browsers that protect privacy let their clocks go in steps, of 100 ms for instance. A hand whose clock stands still
 * and then jumps would run its periods in one batch, on one patch, and lose the periods that are too many for a batch;
 * its samples would leave ten times a second. Timers still come at their usual rate.
 */

const STANDS = 3; // timers within one reading of the clock, from which on it counts as a clock that goes in steps
const LEARNED = 0.2; // share of the newest step in the mean number of timers per step
const CATCH_UP = 0.015; // s that one timer may add at most: fewer periods than the loop runs at once
const STALL = 0.02; // s; if the clock is ahead by more than a step and this, no timers ran meanwhile

export class EvenClock {
  /** Step of the clock [s]; 0 where it is finer than the timers. */
  step = 0;
  private timers = 0;
  /** Mean number of timers per step of the clock. */
  private expected = 0;
  private reading: number;
  private shown: number;

  /** @param read Reads the clock [s]. */
  constructor(private readonly read: () => number) {
    this.reading = this.shown = read();
  }

  /** Time on the even clock [s]; it never goes back. */
  now(): number {
    this.look();
    if (this.step === 0) this.shown = Math.max(this.shown, this.reading);
    return this.shown;
  }

  /** A timer has come. */
  beat(): void {
    this.look();
    this.timers += 1;
    if (this.step === 0) return;
    // The target stays before the clock's next step, however many timers come.
    const target = this.reading + this.step * Math.min(1, this.timers / this.expected);
    const behind = target - this.shown;
    this.shown += behind > this.step + STALL ? behind : Math.min(CATCH_UP, Math.max(0, behind));
  }

  private look(): void {
    const reading = this.read();
    const change = reading - this.reading;
    if (change === 0) return;
    if (change < 0.9 * this.step) this.step = 0;
    else if (this.timers >= STANDS) {
      this.expected = this.step === 0 ? this.timers : this.expected + LEARNED * (this.timers - this.expected);
      this.step = this.step === 0 ? change : Math.min(this.step, change);
    }
    [this.reading, this.timers] = [reading, 0];
  }
}
