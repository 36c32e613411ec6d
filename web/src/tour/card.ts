/** The card of the tour: the number of the step, its text, and the buttons. */

import { el, say, show } from "../ui/dom";
import { icon } from "../ui/icons";
import { type Facts, place, readingTime, type Step, type TourState, waits } from "./machine";

export interface CardActions {
  readonly next: () => void;
  readonly back: () => void;
  readonly pause: () => void;
  readonly close: () => void;
}

export class TourCard {
  readonly root: HTMLElement;
  private readonly title = el("h2", { class: "tour-title", id: "tour-title", attrs: { tabindex: "-1" } });
  private readonly text = el("p", { class: "tour-text" });
  private readonly claim = el("p", { class: "tour-claim" });
  private readonly word = el("p", { class: "tour-word" });
  private readonly skipped = el("p", { class: "tour-word" });
  private readonly progress = el("span", { class: "tour-progress-fill" });
  private readonly count = el("span", { class: "tour-count" });
  private readonly back: HTMLButtonElement;
  private readonly next: HTMLButtonElement;
  private readonly pause: HTMLButtonElement;
  private index = -1;

  constructor(actions: CardActions) {
    const button = (text: string, press: () => void, kind = ""): HTMLButtonElement =>
      el("button", { class: `button ${kind}`, text, attrs: { type: "button" }, on: { click: press } });
    this.back = button("Back", actions.back);
    this.pause = button("Pause", actions.pause);
    this.next = button("Next", actions.next, "primary");
    this.root = el(
      "section",
      { class: "tour", attrs: { "aria-labelledby": "tour-title", "aria-live": "polite" } },
      el("div", { class: "tour-progress", attrs: { "aria-hidden": "true" } }, this.progress),
      el("div", { class: "tour-head" }, this.title, this.count,
        el("button", { class: "icon-button", attrs: { type: "button", "aria-label": "End the tour" }, on: { click: actions.close } }, icon("close"))),
      this.text,
      this.claim,
      this.skipped,
      this.word,
      el("div", { class: "tour-foot" }, this.back, this.pause, el("span", { class: "spring" }), this.next),
    );
    this.root.hidden = true;
  }

  update(steps: readonly Step[], state: TourState | null, facts: Facts | null, now: number): void {
    const step = state === null || state.ended ? undefined : steps[state.index];
    show(this.root, step !== undefined);
    if (state === null || step === undefined) {
      this.index = -1;
      return;
    }
    const last = state.index === steps.length - 1;
    if (this.index !== state.index) {
      this.index = state.index;
      this.root.dataset["step"] = step.id;
      say(this.title, step.title);
      say(this.text, step.text);
      say(this.skipped, state.skipped.join(" "));
      show(this.skipped, state.skipped.length > 0);
      say(this.next, last ? "Done" : "Next");
      this.back.disabled = state.before.length === 0;
      show(this.pause, !last);
      if (!this.root.contains(document.activeElement)) this.title.focus({ preventScroll: true });
    }
    // The number of steps may change meanwhile: a partner comes, or cannot come.
    if (facts !== null) say(this.count, place(steps, state, facts).join(" of "));
    const claim = facts === null ? "" : (step.claim?.(facts) ?? "");
    say(this.claim, claim);
    show(this.claim, claim !== "");
    say(this.pause, state.paused ? "Go on" : "Pause");
    const waiting = waits(steps, state) && step.waiting !== undefined;
    say(this.word, waiting ? `Waiting until ${step.waiting ?? ""}\u2026` : "");
    show(this.word, waiting);
    const share = last ? 1 : Math.min(1, (now - state.since) / readingTime(step));
    this.progress.style.transform = `scaleX(${share.toFixed(3)})`;
  }
}
