/** Positions of the own tip in the last minute, by its own loop and on the server's clock, in memory that does not grow. */

import type { Vec3 } from "../model/vec";
import { lerp } from "../model/vec";

const CAPACITY = 4096; // a minute of 60 reports a second, and a little more
const WIDTH = 4; // time and place
const HOLE = 0.25; // s; in a longer gap between two reports the tip's position is not known

export class OwnTrack {
  private readonly data: Float64Array;
  private next = 0;

  constructor(private readonly capacity = CAPACITY, data?: Float64Array) {
    this.data = data ?? new Float64Array(WIDTH * capacity);
  }

  /** @param t Time on the server's clock [s]; a time that is not newer is left out, a much older time means another clock. */
  push(t: number, tip: Vec3): void {
    const last = this.timeOf(this.next - 1);
    if (this.next > 0 && t < last - 1) this.next = 0;
    else if (this.next > 0 && !(t > last)) return;
    this.data.set([t, ...tip], WIDTH * (this.next % this.capacity));
    this.next += 1;
  }

  /** Position of the tip, interpolated between two reports; null where there were none. */
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

  /** Copy of the present track, which stays the same while this one goes on. */
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
