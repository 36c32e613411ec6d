/**
 * The budget of a period: how much all that the hand's own motion does not cause may do to a force.
 *
 * Each rule takes its part before it acts, so that together they move the force no faster than `EXTERNAL_RATE`. A rule
 * that acts later may have a part reserved for it. `client/cohaptic_client/loop/budget.py` in TypeScript.
 */

/** Change of the force in one period that no rule has taken yet [N]; never below zero. */
export class Budget {
  constructor(public left: number) {}

  /** Take a part, as far as it is there; returns the part [N]. */
  take(wanted: number): number {
    const granted = Math.min(wanted, this.left);
    this.left -= granted;
    return granted;
  }

  /** Set a fraction of what is left aside for a later rule; returns it [N]. */
  reserve(fraction: number): number {
    const before = this.left;
    this.left = before * (1 - fraction);
    return before - this.left;
  }
}
