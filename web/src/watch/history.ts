/** Rolling histories for plots, in memory that never grows. */

import type { Series, UserHistory } from "../model/scene";
import { dot, norm, sub } from "../model/vec";
import type { UserRecord } from "../protocol/scene";

const CAPACITY = 1800; // a minute at 30 frames a second
const MOST_USERS = 64;

/** The newest values of one quantity; a new value replaces the oldest. */
export class Ring implements Series {
  private readonly times: Float64Array;
  private readonly values: Float64Array;
  private start = 0;
  private count = 0;

  constructor(readonly capacity = CAPACITY) {
    this.times = new Float64Array(capacity);
    this.values = new Float64Array(capacity);
  }

  get length(): number {
    return this.count;
  }

  time(i: number): number {
    return this.times[this.index(i)] ?? NaN;
  }

  value(i: number): number {
    return this.values[this.index(i)] ?? NaN;
  }

  push(time: number, value: number): void {
    const at = (this.start + this.count) % this.capacity;
    this.times[at] = time;
    this.values[at] = value;
    if (this.count < this.capacity) this.count += 1;
    else this.start = (this.start + 1) % this.capacity;
  }

  /** Index in the memory; -1 outside of the stored values, which gives NaN. */
  private index(i: number): number {
    return i >= 0 && i < this.count ? (this.start + i) % this.capacity : -1;
  }
}

type Rings = Readonly<Record<keyof UserHistory, Ring>>;

/** Histories of the users of a room. */
export class Histories {
  private readonly users = new Map<number, Rings>(); // in the order of their last record

  get(user: number): UserHistory | null {
    return this.users.get(user) ?? null;
  }

  clear(): void {
    this.users.clear();
  }

  /** Append the users of a scene. */
  push(t_server: number, records: readonly UserRecord[]): void {
    for (const record of records) {
      const rings = this.users.get(record.user) ?? newRings();
      this.users.delete(record.user);
      this.users.set(record.user, rings);
      rings.force.push(t_server, norm(record.force));
      rings.depth.push(t_server, dot(sub(record.x_free, record.probe), record.normal));
      rings.k_o_coupled.push(t_server, record.k_o_coupled);
      rings.k_h.push(t_server, record.k_h);
      rings.loop_delay.push(t_server, record.loop_delay);
    }
    for (const oldest of this.users.keys()) {
      if (this.users.size <= MOST_USERS) break;
      this.users.delete(oldest);
    }
  }
}

function newRings(): Rings {
  return {
    force: new Ring(),
    depth: new Ring(),
    k_o_coupled: new Ring(),
    k_h: new Ring(),
    loop_delay: new Ring(),
  };
}
