/**
 * One way of a path that is made longer on this side: it holds each message until it is due.
 *
 * `shared/cohaptic/simulated/delay_line.py` in TypeScript, without jitter: a stream, in which nothing overtakes. Texts
 * are events, and none is lost. Bytes are states: of those that leave together the newest counts.
 */

export type Message = string | Uint8Array<ArrayBuffer>;

export const LONGEST = 1; // s that a message is held at most
export const CAPACITY = 256; // messages on their way; in a second a hand sends 60 and hears as many

export class DelayLine {
  private readonly items: { readonly due: number; readonly data: Message }[] = [];
  private held = 0;

  /** Of later messages [s], from 0 to `LONGEST`; those on their way keep theirs. */
  set delay(seconds: number) {
    this.held = Math.min(LONGEST, Math.max(0, seconds));
  }

  push(data: Message, now: number): void {
    this.items.push({ due: Math.max(this.items.at(-1)?.due ?? now, now + this.held), data });
  }

  /** What is due at `now`, in order; of more than there is room for, the first are due at once. */
  take(now: number): readonly Message[] {
    const late = this.items.findIndex(({ due }) => due > now);
    const count = late < 0 ? this.items.length : Math.max(late, this.items.length - CAPACITY);
    const out = this.items.splice(0, count).map(({ data }) => data);
    return out.filter((data, i) => typeof data === "string" || out.slice(i + 1).every((later) => typeof later === "string"));
  }
}
