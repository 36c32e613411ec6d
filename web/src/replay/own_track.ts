/** Where the own tip itself was in the last minute, by the hand's own loop and on the server's clock, in memory that does not grow. */

import type { Vec3 } from "../model/vec";
import { lerp } from "../model/vec";

const CAPACITY = 4096; // a minute of 60 reports a second, and a little more
const WIDTH = 4; // time and place
const HOLE = 0.25; // s between two reports, and it is not known where the tip was

export class OwnTrack {
  private readonly data: Float64Array;
  private next = 0;

  constructor(private readonly capacity = CAPACITY, data?: Float64Array) {
    this.data = data ?? new Float64Array(WIDTH * capacity);
  }

  /** @param t Server's clock [s]; what is not newer is left out, and what is much older is another clock. */
  push(t: number, tip: Vec3): void {
    const last = this.timeOf(this.next - 1);
    if (this.next > 0 && t < last - 1) this.next = 0;
    else if (this.next > 0 && !(t > last)) return;
    this.data.set([t, ...tip], WIDTH * (this.next % this.capacity));
    this.next += 1;
  }

  /** Between two reports; null where there were none. */
  at(t: number): Vec3 | null {
    let [low, high] = [Math.max(0, this.next - this.capacity), this.next];
    const first = low;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.timeOf(middle) <= t) low = middle + 1;
      else high = middle;
    }
    if (low === first || low === this.next) return null;
    const [from, to] = [this.timeOf(low - 1), this.timeOf(low)];
    return to - from > HOLE ? null : lerp(this.tipOf(low - 1), this.tipOf(low), (t - from) / (to - from));
  }

  /** As it is now, to be kept while this one goes on. */
  copy(): OwnTrack {
    const made = new OwnTrack(this.capacity, this.data.slice());
    made.next = this.next;
    return made;
  }

  private timeOf(n: number): number {
    return this.data[WIDTH * (n % this.capacity)] ?? NaN;
  }

  private tipOf(n: number): Vec3 {
    const at = WIDTH * (n % this.capacity);
    return [this.data[at + 1] ?? 0, this.data[at + 2] ?? 0, this.data[at + 3] ?? 0];
  }
}
