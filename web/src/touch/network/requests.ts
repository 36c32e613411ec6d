/** The name, law and friction that the user asks for, and which of them the server knows. */

import type { FixedGains, LawName } from "../../model/laws";
import { encodeControl } from "../../protocol/messages";

// 1/s; rate of a change of mu: at 10 N of normal force the force along the surface changes by 10 N/s.
const RATE = 1;

function telling(law: LawName, fixed_gains: FixedGains | null): string {
  return encodeControl({ type: "set_law", law, fixed_gains });
}

export class Requests {
  /** Gains in place of the server's choice; null for none. */
  fixed: FixedGains | null = null;
  private knownLaw = ""; // law and gains that the server knows of
  /** Reason why the server did not give the name that was asked for last; empty for none. */
  nameRefused = "";
  private knownName: string; // name that the server was told last
  private unanswered = 0; // number of name requests without an answer
  private knowsFriction = false; // the last hello asked for friction

  /** @param mu Coefficient of friction of the finger. */
  constructor(
    public name: string,
    public law: LawName,
    public mu: number,
  ) {
    this.knownName = name;
  }

  /** To be called when a hello with name, law and friction was sent. */
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

  /** Take the server's answer; if another name was requested meanwhile, only its answer counts. */
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
   * Whether a new hello is needed, because friction was switched on or off since the last one.
   *
   * @param friction mu in use: it must have reached zero before the server hears that there is no friction.
   */
  needsHello(friction: number): boolean {
    return this.mu > 0 ? !this.knowsFriction : this.knowsFriction && friction === 0;
  }

  /** mu after one more period, in transition to the requested one, so that a choice does not make the force jump. */
  nextFriction(now: number, dt: number): number {
    return Math.min(Math.max(this.mu, now - RATE * dt), now + RATE * dt);
  }
}
