/** Decides when to draw and how many pixels: a slow machine draws fewer, one without graphics hardware rests in between. */

/** Time of a picture from which on fewer pixels are drawn [s]. */
const SLOW = 0.05;
const COARSEST = 0.6; // least number of drawn pixels per pixel of the window, along each side
const IN_SOFTWARE = 0.75; // largest number of them where the processor draws
const STEP = 0.75; // factor on the pixels along each side from one resolution to the next coarser one
const LONGEST_COUNTED = 2 * SLOW; // s; a longer picture counts as this, since a pause of the page looks like a slow picture
const EASY = 0.7 * SLOW; // s; if pictures take less, a finer resolution is tried
const CALM = 120; // fast pictures in a row before a finer resolution is tried for the first time
const CALMEST = 7680; // the same after several trials in vain
const WARM = 4; // first pictures, which do not count because shaders are used for the first time
const LONGEST_REST = 0.2; // s

/** Names of software renderers: SwiftShader in Chromium, llvmpipe and softpipe in Mesa, WARP in Windows, macOS's own. */
const DRAWN_BY_THE_PROCESSOR = /swiftshader|llvmpipe|softpipe|basic render|software/i;

/** Whether a renderer of this name draws with the processor: a browser that was set to use it reports no performance caveat. */
export function isSoftware(renderer: string): boolean {
  return DRAWN_BY_THE_PROCESSOR.test(renderer);
}

export class FramePace {
  /** Pixels drawn per pixel of the window, along each side. */
  ratio: number;
  private finest: number;
  /** Whether the time of the last picture has still to be counted. */
  private drew = false;
  /** Time since the last picture was begun [s]. */
  private took = 0;
  /** Whether the page stood still since the last picture was begun. */
  private interrupted = false;
  private pictures = 0;
  private cost = 0;
  private rest = 0;
  /** Number of fast pictures in a row. */
  private calm = 0;
  private needed = CALM;
  /** Number of pictures since a finer resolution was tried. */
  private tried = Infinity;

  /**
   * @param software Whether the processor draws, which the hand's loop needs too.
   * @param finest Pixels of the display per pixel of the window.
   */
  constructor(private readonly software: boolean, finest: number) {
    this.ratio = this.finest = this.most(finest);
  }

  /** Set the pixels of the display per pixel of the window; the same number as before changes nothing. */
  fit(finest: number): void {
    const most = this.most(finest);
    if (most === this.finest) return;
    // A machine that could not draw all pixels of the former display begins with the same share on the new one.
    this.ratio = Math.min(most, Math.max(COARSEST, (this.ratio * most) / this.finest));
    this.finest = most;
    this.begin();
  }

  /** To be called when the page stands or stood still: the picture begun before does not measure the machine. */
  pause(): void {
    this.interrupted = true;
  }

  /**
   * Decide at the beginning of a frame.
   *
   * @param dt Time since the beginning of the last frame, which is the time of its picture if one was drawn [s].
   * @param wanted Whether there is something to draw.
   * @param drawing Whether the graphics still draw the last picture, without the page waiting for them.
   * @returns Whether to draw a picture now.
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

  /** Begin to measure at another resolution. */
  private begin(): void {
    this.cost = this.calm = 0;
  }
}
