/** A row above the cards: how many watch, a button to point, and whether others may follow. */

import type { Company } from "../model/company";
import { el, say, show } from "../ui/dom";
import { watchingWords } from "./words";

export class CompanyBar {
  private readonly watching = el("span", { class: "company-watching" });
  private readonly point: HTMLButtonElement;
  private readonly open = el("input", { attrs: { type: "checkbox" } });
  private readonly mayFollow = el("label", { class: "company-open" }, this.open, el("span", { text: "Others may follow my view" }));
  readonly root: HTMLElement;

  constructor(point: () => void, setOpen: (open: boolean) => void) {
    this.point = el("button", {
      class: "button company-point",
      text: "Point",
      title: "Show everybody a place on the object: press here, then on it; or press twice; or the key P",
      attrs: { type: "button", "aria-pressed": "false", "aria-keyshortcuts": "P" },
      on: { click: point },
    });
    this.open.addEventListener("change", () => { setOpen(this.open.checked); });
    this.root = el("div", { class: "company" }, this.watching, this.point, this.mayFollow);
  }

  /** @param touches Whether this page has a hand, so that others could follow its view. */
  update(company: Company | null, touches: boolean, open: boolean, armed: boolean): void {
    show(this.root, company !== null);
    say(this.watching, watchingWords(company));
    show(this.point, company?.may_point === true);
    this.point.setAttribute("aria-pressed", `${armed}`);
    this.open.checked = open;
    show(this.mayFollow, touches);
  }
}
