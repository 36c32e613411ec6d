/** One line over the stage: whom this page follows, who follows it, or where to press; with a button to end that. */

import { el, say, show } from "../ui/dom";

export interface PillLine {
  readonly words: string;
  /** Label of the button; empty without a button. */
  readonly button: string;
  readonly press: () => void;
}

export class Pill {
  private readonly words = el("span", { class: "pill-words", attrs: { role: "status" } });
  private readonly button = el("button", { class: "button", attrs: { type: "button" }, on: { click: () => { this.press(); } } });
  readonly root = el("div", { class: "pill" }, this.words, this.button);
  private press = (): void => undefined;

  constructor() {
    this.root.hidden = true;
    this.button.hidden = true;
  }

  /** Show this line, or none. */
  set(line: PillLine | null): void {
    show(this.root, line !== null);
    say(this.words, line?.words ?? "");
    say(this.button, line?.button ?? "");
    show(this.button, line !== null && line.button !== "");
    this.press = line?.press ?? ((): void => undefined);
  }
}
