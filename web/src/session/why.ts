/** Why the force on a hand was as it was at the shown time: rule by rule, from the rows that its client sent. */

import { ProtocolError } from "../protocol/frame";
import { type Fields, isFields, list, parseFields, text } from "../protocol/json";

const MOST_TEXT = 1 << 16; // characters
const PAUSE = 0.4; // s between two questions

/** What one rule did to the force. */
export interface Entry {
  readonly name: string;
  /** Null where it is not known [N]. */
  readonly newtons: number | null;
  readonly words: string;
}

export interface Why {
  readonly entries: readonly Entry[];
  readonly sentence: string;
}

/** Decode the server's answer; null where the file has no rows of that hand and time. Throws ProtocolError. */
export function decodeWhy(said: string): Why | null {
  if (said.trim() === "null") return null;
  const fields = parseFields(said, MOST_TEXT);
  return { sentence: text(fields, "sentence"), entries: list(fields, "entries").map(entry) };
}

function entry(one: unknown): Entry {
  if (!isFields(one)) throw new ProtocolError("entry of a ledger", one, "an object");
  return { name: text(one, "name"), words: text(one, "words"), newtons: newtons(one) };
}

function newtons({ newtons: value }: Fields): number | null {
  if (value !== null && typeof value !== "number") throw new ProtocolError("newtons", value, "a number, or null");
  return value;
}

/** Asks again as the shown time moves on, and no more often than an answer can be read. */
export class WhyAsker {
  /** The newest answer; null before the first, and where there are no rows. */
  answer: Why | null = null;
  /** What is to be read in place of an answer; empty for none. */
  words = "";
  private asked = "";
  private last = -Infinity;
  private waiting = false;

  /** @param fetch Fetches the answer about a user at a time on the server's clock [s]. */
  constructor(private readonly fetch: (user: number, t: number) => Promise<string>) {}

  /**
   * @param user Number of the user; null for nobody.
   * @param t Shown time on the server's clock [s].
   * @param now Time on the page's clock [s].
   */
  ask(user: number | null, t: number, now: number): void {
    if (user === null) {
      [this.answer, this.words, this.asked] = [null, "Nobody is here at this time.", ""];
      return;
    }
    const key = `${user} ${t}`;
    if (this.waiting || key === this.asked || now - this.last < PAUSE) return;
    [this.asked, this.last, this.waiting] = [key, now, true];
    this.fetch(user, t).then(decodeWhy).then(
      (answer) => {
        if (this.asked === "") return; // everybody has left meanwhile
        this.answer = answer;
        this.words = answer === null ? "The file has no rows of this hand from this time: its client sent none." : "";
      },
      (error: unknown) => {
        this.answer = null;
        this.words = `The answer does not come: ${error instanceof Error ? error.message : String(error)}`;
      },
    ).finally(() => { this.waiting = false; });
  }
}

