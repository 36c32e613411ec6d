/** What each rule of the loop does to the visitor's own force, now and in the last seconds; loaded when it is first shown. */

import type { Explained, Ledger, TouchHandle } from "../../model/hand";
import { ENTRIES, type EntryName, type RuleName, RULES } from "../../model/rules";
import { el, say, show } from "../dom";
import { TraceBuffer } from "../plots/trace_buffer";
import { fixed } from "../words";

const SPAN = 6; // s, as the plots
const REPORTS = 400; // of the hand in that time, and some more
const SEEN = 0.005; // N; a smaller entry is written as zero
const LEAST = 1; // N; the bars of a smaller force are no longer
const NAMES = Object.keys(ENTRIES) as EntryName[];

/** One rule: its words, its bar, and its newtons now and at most in the last seconds. */
export interface Row {
  readonly root: HTMLElement;
  readonly bar: HTMLElement;
  readonly now: HTMLElement;
  readonly most: HTMLElement;
}

export class ForceLedger {
  readonly root: HTMLDetailsElement;
  private readonly rows = NAMES.map((name) => row(name, ENTRIES[name]));
  private readonly sum = row("force", "on your hand: all of them together");
  private readonly missing = el("summary");
  private readonly reasons = el("ul");
  private readonly lacks = el("details", { class: "ledger-lacks fine" }, this.missing, this.reasons);
  private readonly trace = new TraceBuffer(NAMES.length + 1, REPORTS);
  private handle: TouchHandle | null = null;
  private stop = (): unknown => undefined;

  constructor() {
    const head = el("tr", {}, el("th", { text: "Rule", attrs: { scope: "col" } }), el("th", { text: "now", attrs: { scope: "col" } }), el("th", { text: `most in ${SPAN}\u202fs`, attrs: { scope: "col" } }));
    this.root = el(
      "details",
      { class: "ledger", attrs: { open: "" } },
      el("summary", { text: "Why this force, rule by rule, in newtons" }),
      el("table", {}, el("thead", {}, head), el("tbody", {}, ...this.rows.map(({ root }) => root), this.sum.root)),
      this.lacks,
    );
    this.sum.root.classList.add("ledger-sum");
  }

  /** @param handle The visitor's hand; null while nobody is to look at its force. */
  update(handle: TouchHandle | null): void {
    show(this.root, handle !== null);
    if (handle !== this.handle) {
      this.stop();
      this.handle?.explain(false);
      this.handle = handle;
      this.trace.clear();
      this.stop = handle?.subscribe(() => { this.record(handle); }) ?? this.stop;
    }
    const looked = this.root.open && this.root.offsetParent !== null;
    handle?.explain(looked);
    const explained = handle?.state?.explained ?? null;
    if (looked && explained !== null) this.write(explained);
  }

  private record({ state }: TouchHandle): void {
    const ledger = state?.explained?.ledger;
    if (state != null && ledger != null) this.trace.push(state.t, [...NAMES.map((name) => ledger[name]), reach(ledger)]);
  }

  private write({ lacking, ledger }: Explained): void {
    this.tellMissing(lacking);
    const since = this.trace.last - SPAN;
    const full = Math.max(LEAST, this.trace.range([NAMES.length], since)?.high ?? 0);
    let sum = 0;
    this.rows.forEach((row, i) => {
      const name = NAMES[i] as EntryName;
      // A ledger has an entry of each rule, also of one that this page lacks.
      show(row.root, !lacking.includes(name));
      const { low, high } = this.trace.range([i], since) ?? { low: 0, high: 0 };
      fill(row, sum, ledger?.[name] ?? 0, -low > high ? low : high, full);
      sum += ledger?.[name] ?? 0;
    });
    fill(this.sum, 0, sum, null, full);
  }

  private tellMissing(names: readonly RuleName[]): void {
    show(this.lacks, names.length > 0);
    const words = `This page has no rule: ${names.join(", ")}`;
    if (this.missing.textContent === words) return;
    say(this.missing, words);
    this.reasons.replaceChildren(
      el("li", { text: "The loop of the Python client has them besides:" }),
      ...names.map((name) => el("li", {}, el("b", { text: name }), ` \u2013 ${RULES[name]}`)),
    );
  }
}

/** The largest sum of the first entries of a ledger, which the bars have to hold [N]. */
export function reach(ledger: Ledger): number {
  let [sum, most] = [0, 0];
  for (const name of NAMES) most = Math.max(most, (sum += ledger[name]));
  return most;
}

export function row(name: string, words: string): Row {
  const bar = el("span", { class: "ledger-bar" });
  const [now, most] = [el("td"), el("td")];
  const what = el("th", { attrs: { scope: "row" } }, el("b", { text: name }), words === name ? null : ` ${words}`, el("span", { class: "ledger-track", attrs: { "aria-hidden": "true" } }, bar));
  return { root: el("tr", { attrs: { "data-entry": name } }, what, now, most), bar, now, most };
}

/** Show an entry, which begins where those before it end; `most` is null where it is not to be told. */
export function fill({ root, bar, now, most }: Row, from: number, newtons: number, strongest: number | null, full: number): void {
  const low = Math.max(0, Math.min(from, from + newtons));
  bar.style.transform = `translateX(${((100 * low) / full).toFixed(2)}%) scaleX(${(Math.abs(newtons) / full).toFixed(4)})`;
  bar.classList.toggle("less", newtons < 0);
  say(now, fixed(newtons, 2));
  if (strongest !== null) say(most, fixed(strongest, 2));
  root.classList.toggle("idle", Math.abs(newtons) < SEEN && Math.abs(strongest ?? 0) < SEEN);
}
