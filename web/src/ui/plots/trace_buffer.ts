/** The last seconds of several quantities of one user, in memory that does not grow. */

import type { Range } from "../../model/scale";

export class TraceBuffer {
  readonly times: Float64Array;
  readonly columns: readonly Float32Array[];
  private next = 0;
  private filled = 0;

  /**
   * @param width Number of quantities in a sample.
   * @param capacity Number of samples that are kept; the newest replace the oldest.
   */
  constructor(width: number, capacity: number) {
    this.times = new Float64Array(capacity);
    this.columns = Array.from({ length: width }, () => new Float32Array(capacity));
  }

  get length(): number {
    return this.filled;
  }

  /** Time of the newest sample; -Infinity without samples. */
  get last(): number {
    const n = this.times.length;
    return this.filled === 0 ? -Infinity : (this.times[(this.next + n - 1) % n] ?? -Infinity);
  }

  /** Take a sample; a sample that is not newer than the last is the same frame again and is left out. */
  push(time: number, values: readonly number[]): void {
    if (!(time > this.last)) return;
    this.times[this.next] = time;
    this.columns.forEach((column, i) => {
      column[this.next] = values[i] ?? Number.NaN;
    });
    this.next = (this.next + 1) % this.times.length;
    this.filled = Math.min(this.filled + 1, this.times.length);
  }

  /** Forget everything: a clock that began anew would otherwise never be newer. */
  clear(): void {
    this.next = 0;
    this.filled = 0;
  }

  /** Visit a quantity from old to new, from time `since` on; nan marks a gap. */
  each(column: number, since: number, visit: (time: number, value: number) => void): void {
    const data = this.columns[column];
    if (data === undefined) return;
    const n = this.times.length;
    for (let k = 0; k < this.filled; k++) {
      const i = (this.next - this.filled + k + n) % n;
      const time = this.times[i] ?? 0;
      if (time >= since) visit(time, data[i] ?? Number.NaN);
    }
  }

  /** Least and largest value of some quantities since a time; null without values. */
  range(columns: readonly number[], since: number): Range | null {
    let low = Infinity;
    let high = -Infinity;
    for (const column of columns) {
      this.each(column, since, (_, value) => {
        if (value < low) low = value;
        if (value > high) high = value;
      });
    }
    return low <= high ? { low, high } : null;
  }
}
