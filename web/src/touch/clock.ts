/**
 * A clock that goes in steps, made even by counting timers between two of them.
 *
 * Browsers that protect privacy let their clocks go in steps, of 100 ms for instance. A hand whose clock stands still
 * and then jumps would run its periods in one lump, on one patch, and lose those that are too many for a lump; its
 * samples would leave ten times a second. Timers come as often as ever.
 */

const STANDS = 3; // timers within one reading: a clock whose steps are worth a word
const LEARNED = 0.2; // share of a new step in the number of timers for one
const CATCH_UP = 0.015; // s at a timer, at most: fewer than the periods that the loop runs at once
const STALL = 0.02; // s; a clock that is farther ahead than by a step and this did not go while nothing ran

export class EvenClock {
  /** In which the clock goes [s]; 0 where it goes finer than timers. */
  step = 0;
  private timers = 0;
  /** That come while it makes a step. */
  private expected = 0;
  private reading: number;
  private shown: number;

  /** @param read The clock [s]. */
  constructor(private readonly read: () => number) {
    this.reading = this.shown = read();
  }

  /** [s]; never less than before. */
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
    // Before the clock's next step, however many timers come.
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
