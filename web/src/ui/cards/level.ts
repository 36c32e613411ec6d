/** The two levels of the page: first the people; gains, laws and plots for visitors who ask for them. */

import { el } from "../dom";
import { keep, recall } from "../theme";

const KEY = "cohaptic.engineer";
const CLASS = "engineer";
const PEOPLE = "people";

export class Level {
  readonly root: HTMLButtonElement;
  private readonly page: () => HTMLElement | null;

  /** @param page Returns the element with the class of the level; null before it exists. */
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

  /** Begin with the level in the address, or else with the visitor's last one; an unknown level is ignored. */
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
