/** Frames and bytes over a connection. */

const SPAN = 1; // s

/** Counts frames and bytes, all and those of the last second. */
export class Traffic {
  frames = 0;
  bytes = 0;
  private recent: { readonly at: number; readonly bytes: number }[] = [];

  push(at: number, bytes: number): void {
    this.frames += 1;
    this.bytes += bytes;
    this.recent = [...this.recent.filter((one) => one.at > at - SPAN), { at, bytes }];
  }

  /** Frames and bytes per second at `now`. */
  rates(now: number): { readonly frames: number; readonly bytes: number } {
    const counted = this.recent.filter(({ at }) => at > now - SPAN);
    return {
      frames: counted.length / SPAN,
      bytes: counted.reduce((sum, { bytes }) => sum + bytes, 0) / SPAN,
    };
  }
}
