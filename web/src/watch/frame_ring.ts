/** The scene frames of the last minute, as received bytes, in memory that does not grow. */

/** Age up to which frames are kept [s]. */
export const KEPT = 60;
/** Most bytes that are kept: a minute of forces of 16 hands takes 2.5 MB, a minute of surfaces of 2,562 vertices 7 MB. */
export const MOST_BYTES = 8 << 20;
const MOST_FRAMES = 4096; // a minute at 60 a second, and a little more

/** Frames in the order in which they came. */
export interface KeptFrames {
  /** Times on the server's clock [s], rising. */
  readonly times: Float64Array;
  readonly frames: readonly Uint8Array[];
}

/** The newest frames; the oldest are dropped as soon as a bound on time, bytes or number is reached. */
export class FrameRing {
  private readonly bytes: Uint8Array;
  private readonly times: Float64Array;
  private readonly starts: Uint32Array;
  private readonly lengths: Uint32Array;
  private oldest = 0; // number of the oldest frame; frames are numbered as they come
  private next = 0;
  private head = 0; // index in `bytes` of the next frame

  constructor(bytes = MOST_BYTES, private readonly most = MOST_FRAMES, private readonly seconds = KEPT) {
    this.bytes = new Uint8Array(bytes);
    this.times = new Float64Array(most);
    this.starts = new Uint32Array(most);
    this.lengths = new Uint32Array(most);
  }

  get length(): number {
    return this.next - this.oldest;
  }

  /** Time from the oldest kept frame to the newest [s]. */
  get span(): number {
    return this.length === 0 ? 0 : this.timeOf(this.next - 1) - this.timeOf(this.oldest);
  }

  clear(): void {
    this.oldest = this.next;
    this.head = 0;
  }

  /**
   * Keep a frame that came.
   *
   * @param t Time on the server's clock [s]; a restarted server has another clock, and the former frames are dropped.
   */
  push(t: number, frame: Uint8Array): void {
    if (this.length > 0 && t <= this.timeOf(this.next - 1)) this.clear();
    if (frame.length > this.bytes.length) return;
    if (this.head + frame.length > this.bytes.length) {
      // The end of the buffer is too short for the frame; frames there are older than all at its beginning, and are dropped.
      while (this.length > 0 && this.startOf(this.oldest) >= this.head) this.oldest += 1;
      this.head = 0;
    }
    while (this.length > 0 && (this.liesIn(this.oldest, this.head, frame.length) || this.length === this.most || this.timeOf(this.oldest) < t - this.seconds)) this.oldest += 1;
    const slot = this.next % this.most;
    this.times[slot] = t;
    this.starts[slot] = this.head;
    this.lengths[slot] = frame.length;
    this.bytes.set(frame, this.head);
    this.head += frame.length;
    this.next += 1;
  }

  /** A copy of the kept frames, which does not change when the ring goes on. */
  take(): KeptFrames {
    const numbers = Array.from({ length: this.length }, (_, k) => this.oldest + k);
    return {
      times: Float64Array.from(numbers, (n) => this.timeOf(n)),
      frames: numbers.map((n) => this.bytes.slice(this.startOf(n), this.startOf(n) + this.lengthOf(n))),
    };
  }

  private timeOf(n: number): number {
    return this.times[n % this.most] ?? NaN;
  }

  private startOf(n: number): number {
    return this.starts[n % this.most] ?? 0;
  }

  private lengthOf(n: number): number {
    return this.lengths[n % this.most] ?? 0;
  }

  /** Whether frame `n` overlaps the `length` bytes from `start` on. */
  private liesIn(n: number, start: number, length: number): boolean {
    return this.startOf(n) < start + length && start < this.startOf(n) + Math.max(1, this.lengthOf(n));
  }
}
