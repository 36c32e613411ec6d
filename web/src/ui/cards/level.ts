/** The two levels of the page: people first; gains, laws and plots for who asks for them. */

import { el } from "../dom";
import { keep, recall } from "../theme";

const KEY = "cohaptic.engineer";
const CLASS = "engineer";
const PEOPLE = "people";

export class Level {
  readonly root: HTMLButtonElement;
  private readonly page: () => HTMLElement | null;

  /** @param page Element that carries the class of the level; null before it is there. */
  constructor(page: () => HTMLElement | null) {
    this.page = page;
    this.root = el("button", {
      class: "button level",
      text: "Engineer",
      title: "Gains, laws, plots and the stability of the room",
      attrs: { type: "button", "aria-pressed": "false" },
      on: {
        click: () => {
          const engineer = this.root.getAttribute("aria-pressed") !== "true";
          keep(KEY, engineer ? "yes" : "no");
          this.show(engineer);
        },
      },
    });
  }

  /** As the address says, or else as the visitor had it last; what is no level says nothing. */
  begin(search: string): void {
    const asked = new URLSearchParams(search).get("view");
    this.show(asked === CLASS || asked === PEOPLE ? asked === CLASS : recall(KEY) === "yes");
  }

  get engineer(): boolean {
    return this.root.getAttribute("aria-pressed") === "true";
  }

  show(engineer: boolean): void {
    this.root.setAttribute("aria-pressed", `${engineer}`);
    this.page()?.classList.toggle(CLASS, engineer);
  }
}
