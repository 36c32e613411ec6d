/**
 * A delay in one direction of a path: the line holds each message until it is due.
 *
 * `shared/cohaptic/simulated/delay_line.py` in TypeScript, without jitter: no message overtakes another. Texts are
 * events, and none is lost. Bytes are states: of several that leave together only the newest is passed on.
 */

export type Message = string | Uint8Array<ArrayBuffer>;

export const LONGEST = 1; // s for which a message is held at most
export const CAPACITY = 256; // messages that are held; a hand sends 60 in a second and receives as many

export class DelayLine {
  private readonly items: { readonly due: number; readonly data: Message }[] = [];
  private held = 0;

  /** Delay of later messages [s], from 0 to `LONGEST`; held messages keep their delay. */
  set delay(seconds: number) {
    this.held = Math.min(LONGEST, Math.max(0, seconds));
  }

  push(data: Message, now: number): void {
    this.items.push({ due: Math.max(this.items.at(-1)?.due ?? now, now + this.held), data });
  }

  /** Messages that are due at `now`, in order; if more are held than there is room for, the first are due at once. */
  take(now: number): readonly Message[] {
    const late = this.items.findIndex(({ due }) => due > now);
    const count = late < 0 ? this.items.length : Math.max(late, this.items.length - CAPACITY);
    const out = this.items.splice(0, count).map(({ data }) => data);
    return out.filter((data, i) => typeof data === "string" || out.slice(i + 1).every((later) => typeof later === "string"));
  }
}
