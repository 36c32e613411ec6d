/** A ghost hand that shows the gesture once to a visitor who has never pressed. */

import { el, show } from "./dom";
import { icon } from "./icons";
import { keep, recall } from "./theme";

const KEY = "cohaptic.pressed";

export class Ghost {
  readonly root: HTMLElement;
  private known = recall(KEY) === "yes";

  constructor() {
    this.root = el(
      "div",
      { class: "ghost" },
      el("span", { class: "ghost-hand", attrs: { "aria-hidden": "true" } }, icon("touch")),
      el("p", { class: "ghost-words", text: "Press here and hold. Whoever else is here feels it; you see your force, you do not feel it." }),
    );
    this.root.hidden = true;
  }

  show(wanted: boolean): void {
    show(this.root, wanted && !this.known);
  }

  /** To be called when the visitor has pressed. */
  learned(): void {
    if (this.known) return;
    this.known = true;
    keep(KEY, "yes");
    show(this.root, false);
  }
}
