/** The name, law and friction that the user asks for, and which of them the server knows. */

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
  private knownLaw = ""; // law and gains that the server knows of
  /** Why the server did not give the name that was asked for last; empty for no reason. */
  nameRefused = "";
  private knownName: string; // that the server was told last
  private unanswered = 0; // names
  private knowsFriction = false; // the last hello asked for friction

  /** @param mu Of the finger. */
  constructor(
    public name: string,
    public law: LawName,
    public mu: number,
  ) {
    this.knownName = name;
  }

  /** A hello with name, law and friction was sent. */
  greet(): void {
    this.knownName = this.name;
    this.unanswered = 0;
    this.knownLaw = telling(this.law, null);
    this.knowsFriction = this.mu > 0;
  }

  /** Ask for another name. */
  setName(name: string): void {
    this.name = name;
    this.nameRefused = "";
  }

  /** The message that asks for the name; null where the server knows it. */
  nameRequest(): string | null {
    if (this.name === this.knownName) return null;
    this.knownName = this.name;
    this.unanswered += 1;
    return encodeControl({ type: "set_name", name: this.name });
  }

  /** The server has answered; where it was asked again meanwhile, the next answer counts. */
  named(name: string, reason: string): void {
    this.unanswered -= 1;
    if (this.unanswered > 0 || this.name !== this.knownName) return;
    this.name = this.knownName = name;
    this.nameRefused = reason;
  }

  /** The message that asks for the law; null where the server knows it. */
  lawRequest(): string | null {
    const message = telling(this.law, this.fixed);
    if (message === this.knownLaw) return null;
    this.knownLaw = message;
    return message;
  }

  /**
   * Whether the last hello was for another finger than the present one.
   *
   * @param friction mu in use: a finger becomes smooth before the server hears of it.
   */
  needsHello(friction: number): boolean {
    return this.mu > 0 ? !this.knowsFriction : this.knowsFriction && friction === 0;
  }

  /** mu after one more period, in transition to the requested one, so that a choice does not step the force. */
  nextFriction(now: number, dt: number): number {
    return Math.min(Math.max(this.mu, now - RATE * dt), now + RATE * dt);
  }
}
