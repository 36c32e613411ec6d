/** The help dialog. */

import { el } from "./dom";
import { icon } from "./icons";
import { SHORTCUTS } from "./keyboard";

export class Help {
  readonly root: HTMLDialogElement;

  constructor() {
    const rows = SHORTCUTS.filter((s) => s.shown !== "").map((s) =>
      el("div", {}, el("dt", {}, ...s.shown.split(" ").map((key) => el("kbd", { text: key }))), el("dd", { text: s.words })),
    );
    const close = el(
      "button",
      { class: "icon-button dialog-close", attrs: { type: "button", "aria-label": "Close" }, on: { click: () => { this.root.close(); } } },
      icon("close"),
    );
    this.root = el(
      "dialog",
      { class: "dialog", attrs: { "aria-labelledby": "help-title" } },
      close,
      el("h2", { id: "help-title", text: "One object, many hands" }),
      el("p", {
        text: "Everybody who touches the object feels the others through it, however far away they are. Each hand has a tip, "
          + "a stem with a name, an arrow as long as the force on it, and a sheet: the surface that its own haptic loop presses "
          + "on between two messages of the server.",
      }),
      el("h3", { text: "Touch" }),
      el("p", {
        text: "Press on the object and hold: that brings your hand in. Drag to slide. The wheel, Shift with a drag, a pen\u2019s "
          + "pressure or a second finger go deeper. With friction your finger sticks, and others drag it along. Beside the object a "
          + "drag turns the view; two fingers or the wheel zoom.",
      }),
      el("h3", { text: "Keys" }),
      el("dl", { class: "keys" }, ...rows),
    );
    this.root.addEventListener("click", (event) => {
      if (event.target === this.root) this.root.close();
    });
  }

  toggle(): void {
    if (this.root.open) this.root.close();
    else this.root.showModal();
  }
}
