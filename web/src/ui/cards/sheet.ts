/** The column as a sheet on a phone: its handle draws it up from below, by a tap, a key or a drag. */

import { el } from "../dom";

const FAR = 24; // px; a shorter drag may be an accident and does not count

export class Sheet {
  readonly root: HTMLButtonElement;
  private from: number | null = null;
  private dragged = false;
  private readonly page: () => HTMLElement | null;

  /** @param page Returns the element with the class of the sheet; null before it exists. */
  constructor(page: () => HTMLElement | null) {
    this.page = page;
    this.root = el("button", {
      class: "sheet-handle",
      attrs: { type: "button", "aria-label": "Hands and plots", "aria-expanded": "false", "aria-controls": "panel" },
      on: {
        click: () => {
          if (!this.dragged) this.draw(!this.up);
          this.dragged = false;
        },
      },
    });
    this.root.addEventListener("pointerdown", (event) => {
      this.from = event.clientY;
      this.dragged = false;
      this.root.setPointerCapture(event.pointerId);
    });
    this.root.addEventListener("pointermove", (event) => {
      if (this.from === null || Math.abs(event.clientY - this.from) < FAR) return;
      this.dragged = true;
      this.draw(event.clientY < this.from);
    });
    this.root.addEventListener("pointerup", () => { this.from = null; });
    this.root.addEventListener("pointercancel", () => { this.from = null; });
  }

  private get up(): boolean {
    return this.root.getAttribute("aria-expanded") === "true";
  }

  private draw(up: boolean): void {
    this.root.setAttribute("aria-expanded", `${up}`);
    this.page()?.classList.toggle("sheet-up", up);
  }
}
