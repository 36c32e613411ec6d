/** When to draw, and how many pixels: a machine that cannot keep up draws fewer, one without graphics rests between. */

/** Slower than this, and fewer pixels are drawn [s]. */
const SLOW = 0.05;
const COARSEST = 0.6; // pixels drawn for one of the window
const IN_SOFTWARE = 0.75; // of them at the start, where the processor draws
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
  /** Whether the last picture has still to be counted. */
  private drew = false;
  /** Since that was begun [s]. */
  private took = 0;
  private pictures = 0;
  private cost = 0;
  private rest = 0;

  /**
   * @param software Whether the processor draws, which the hand's loop needs too.
   * @param finest Pixels that the display has for one of the window.
   */
  constructor(private readonly software: boolean, finest: number) {
    this.ratio = software ? IN_SOFTWARE : finest;
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
      this.spare(this.took);
      this.rest = this.software ? Math.min(this.took, LONGEST_REST) : 0;
    } else this.rest -= dt;
    if (!wanted || this.rest > 0) return false;
    [this.drew, this.took] = [true, 0];
    this.pictures += 1;
    return true;
  }

  private spare(seconds: number): void {
    if (this.pictures < WARM) return;
    this.cost += 0.15 * (Math.min(seconds, 0.5) - this.cost);
    if (this.cost < SLOW || this.ratio <= COARSEST) return;
    this.ratio = Math.max(COARSEST, 0.75 * this.ratio);
    this.cost = 0;
  }
}
