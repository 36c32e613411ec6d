/** When to draw, and how many pixels: a machine that cannot keep up draws fewer, one without graphics rests between. */

/** Slower than this, and fewer pixels are drawn [s]. */
const SLOW = 0.05;
const COARSEST = 0.6; // pixels drawn for one of the window
const IN_SOFTWARE = 0.75; // of them at the start, where the processor draws
const STEP = 0.75; // of the pixels along each side, from one resolution to the next coarser one
const LONGEST_COUNTED = 2 * SLOW; // s; no picture counts for more, since a pause of the page looks like a slow one
const EASY = 0.7 * SLOW; // s; where pictures take less, a finer resolution is tried
const CALM = 120; // of them, before it is tried the first time
const CALMEST = 7680; // of them, where each trial was in vain
const WARM = 4; // pictures after which their time is that of drawing, not of shaders that are used the first time
const LONGEST_REST = 0.2; // s

/** SwiftShader in Chromium, llvmpipe and softpipe in Mesa, WARP in Windows, macOS's own. */
const DRAWN_BY_THE_PROCESSOR = /swiftshader|llvmpipe|softpipe|basic render|software/i;

/** Whether a renderer of this name draws with the processor: a browser that was told to use it sees no caveat in it. */
export function isSoftware(renderer: string): boolean {
  return DRAWN_BY_THE_PROCESSOR.test(renderer);
}

export class FramePace {
  /** Pixels drawn for one of the window. */
  ratio: number;
  private finest: number;
  /** Whether the last picture has still to be counted. */
  private drew = false;
  /** Since that was begun [s]. */
  private took = 0;
  /** Whether the page stood still meanwhile. */
  private interrupted = false;
  private pictures = 0;
  private cost = 0;
  private rest = 0;
  /** Pictures in a row that took little. */
  private calm = 0;
  private needed = CALM;
  /** Pictures since a finer resolution was tried. */
  private tried = Infinity;

  /**
   * @param software Whether the processor draws, which the hand's loop needs too.
   * @param finest Pixels that the display has for one of the window.
   */
  constructor(private readonly software: boolean, finest: number) {
    this.ratio = this.finest = this.most(finest);
  }

  /** The window is on a display with so many pixels for one of its own; where it is the same, nothing changes. */
  fit(finest: number): void {
    const most = this.most(finest);
    if (most === this.finest) return;
    // A machine that could not draw all pixels of the one before has to try first whether it can of this one.
    this.ratio = Math.min(most, Math.max(COARSEST, (this.ratio * most) / this.finest));
    this.finest = most;
    this.begin();
  }

  /** The page stands still, or has stood still: what was begun before is no measure of the machine. */
  pause(): void {
    this.interrupted = true;
  }

  /**
   * Decide at the beginning of a frame.
   *
   * @param dt Since the beginning of the one before: what that took, if something was drawn [s].
   * @param wanted Whether there is something to draw.
   * @param drawing Whether the graphics still draw the picture before, and the page does not wait for them.
   * @returns Whether it is drawn now.
   */
  next(dt: number, wanted: boolean, drawing = false): boolean {
    if (this.drew) {
      this.took += dt;
      if (drawing) return false;
      this.drew = false;
      if (!this.interrupted) this.count(this.took);
      this.rest = this.software ? Math.min(this.took, LONGEST_REST) : 0;
    } else this.rest -= dt;
    if (!wanted || this.rest > 0) return false;
    [this.drew, this.took, this.interrupted] = [true, 0, false];
    this.pictures += 1;
    return true;
  }

  private most(finest: number): number {
    return this.software ? Math.min(IN_SOFTWARE, finest) : finest;
  }

  private count(seconds: number): void {
    if (this.pictures < WARM) return;
    this.cost += 0.15 * (Math.min(seconds, LONGEST_COUNTED) - this.cost);
    this.calm = this.cost < EASY ? this.calm + 1 : 0;
    this.tried += 1;
    if (this.cost >= SLOW && this.ratio > COARSEST) {
      if (this.tried < this.needed) this.needed = Math.min(CALMEST, 2 * this.needed);
      this.ratio = Math.max(COARSEST, STEP * this.ratio);
      this.begin();
    } else if (this.calm >= this.needed && this.ratio < this.finest) {
      this.ratio = Math.min(this.finest, this.ratio / STEP);
      this.tried = 0;
      this.begin();
    }
  }

  /** At another resolution. */
  private begin(): void {
    this.cost = this.calm = 0;
  }
}
