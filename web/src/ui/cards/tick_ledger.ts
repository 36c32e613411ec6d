/** What the server made of a user's force, and in which rules the user's loop differs; loaded for who opens Engineer. */

import { TICK } from "../../model/rules";
import type { LoopRules, TickLedger, UserState } from "../../model/scene";
import { el, say, show } from "../dom";
import { fixed } from "../words";

const SEEN = 0.01; // N; a smaller entry is not worth a word
const SOFTER = 1; // N/m; a gain that is less by no more is not, either
type Entry = keyof typeof TICK;
const ENTRIES = Object.keys(TICK) as Entry[];

export class TickNotes {
  readonly root = el("div");
  private readonly tick = el("p", { class: "fine" });
  private readonly rules = el("p", { class: "fine" });

  constructor() {
    this.root.append(this.tick, this.rules);
  }

  write(user: UserState | undefined): void {
    for (const [line, words] of [[this.tick, user === undefined ? "" : tickWords(user.ledger)], [this.rules, rulesWords(user?.rules ?? null)]] as const) {
      say(line, words);
      show(line, words !== "");
    }
    this.tick.title = user === undefined ? "" : cuts(user.ledger).map(([name]) => `${short(name)}: ${TICK[name]}`).join("\n");
  }
}

/** What the tick made of a force, in a sentence; empty if it left the force as it was. */
export function tickWords(ledger: TickLedger): string {
  const parts = cuts(ledger).map(([name, newtons]) => `${newtons < 0 ? "less" : "plus"} ${fixed(Math.abs(newtons), 2)} N by ${short(name)}`);
  const carried = parts.length === 0 ? "" : `On its way to the object: ${parts.join(", ")}.`;
  const softer = ledger.gain_cut < SOFTER ? "" : `Models of others stiffen the contact: the gain is ${fixed(ledger.gain_cut, 0)} N/m less.`;
  return [carried, softer].filter((words) => words !== "").join(" ");
}

/** In which rules a loop differs, in a sentence; empty if in none. */
export function rulesWords(rules: LoopRules | null): string {
  if (rules === null) return "";
  const added = rules.added.length === 0 ? "" : `Rules of other packages: ${rules.added.join(", ")}.`;
  const lacking = rules.lacking.length === 0 ? "" : `Its loop has no rule: ${rules.lacking.join(", ")}.`;
  return [added, lacking].filter((words) => words !== "").join(" ");
}

function cuts(ledger: TickLedger): (readonly [Entry, number])[] {
  return ENTRIES.map((name) => [name, ledger[name]] as const).filter(([, newtons]) => Math.abs(newtons) >= SEEN);
}

function short(name: Entry): string {
  return name.replace("by_", "");
}
