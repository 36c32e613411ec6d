/** What the user wants of law and finger, and what the server knows of that. */

import type { FixedGains, LawName } from "../../model/laws";
import { encodeControl } from "../../protocol/messages";

// 1/s; of a coefficient of friction: at 10 N of pressure the force along the surface moves by 10 N/s.
const RATE = 1;

function telling(law: LawName, fixed_gains: FixedGains | null): string {
  return encodeControl({ type: "set_law", law, fixed_gains });
}

export class Requests {
  /** Gains instead of the server's. */
  fixed: FixedGains | null = null;
  private told = ""; // law and gains that the server knows of
  private rough = false; // whether it knows of friction

  /** @param mu Of the finger. */
  constructor(
    public law: LawName,
    public mu: number,
  ) {}

  /** A hello is on its way, which speaks of law and friction. */
  greet(): void {
    this.told = telling(this.law, null);
    this.rough = this.mu > 0;
  }

  /** What to say of the law; null where the server knows it. */
  lawToTell(): string | null {
    const wanted = telling(this.law, this.fixed);
    if (wanted === this.told) return null;
    this.told = wanted;
    return wanted;
  }

  /**
   * Whether the last hello was for another finger than the wanted one.
   *
   * @param friction mu in use: a finger becomes smooth before the server hears of it.
   */
  needsHello(friction: number): boolean {
    return this.mu > 0 ? !this.rough : this.rough && friction === 0;
  }

  /** mu after one more period, on its way to the wanted one: a choice does not move the force fast, either. */
  nextFriction(now: number, dt: number): number {
    return Math.min(Math.max(this.mu, now - RATE * dt), now + RATE * dt);
  }
}
