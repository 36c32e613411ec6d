/** The element that shows a notice. */

import { el, say, show } from "./dom";
import { icon } from "./icons";
import type { Notice } from "./notice";

export class NoticeBar {
  readonly root: HTMLElement;
  private readonly title = el("strong", { class: "notice-title", attrs: { role: "status" } }); // spoken, unlike the counting text
  private readonly text = el("span", { class: "notice-text" });
  private readonly reload: HTMLButtonElement;
  private readonly wait: HTMLButtonElement;
  private readonly dismiss: HTMLButtonElement;
  private shown = "";
  private readonly put = new Set<string>();

  /** @param wait Called to wait for a place in a full room. */
  constructor(reload: () => void, wait: () => void) {
    this.reload = el("button", { class: "button primary", text: "Reload", attrs: { type: "button" }, on: { click: reload } });
    this.wait = el("button", { class: "button primary wait", text: "Wait for a place", attrs: { type: "button" }, on: { click: wait } });
    this.dismiss = el(
      "button",
      {
        class: "icon-button",
        attrs: { type: "button", "aria-label": "Put this message away" },
        on: {
          click: () => {
            this.put.add(this.shown);
            show(this.root, false);
          },
        },
      },
      icon("close"),
    );
    this.root = el(
      "div",
      { class: "notice" },
      el("span", { class: "notice-mark", attrs: { "aria-hidden": "true" } }),
      el("div", { class: "notice-words" }, this.title, this.text),
      this.reload,
      this.wait,
      this.dismiss,
    );
    this.root.hidden = true;
  }

  set(notice: Notice | null): void {
    if (notice === null || this.put.has(notice.key)) {
      show(this.root, false);
      // A dismissed notice may be shown again when its cause occurs again.
      if (notice === null) this.put.clear();
      return;
    }
    this.shown = notice.key;
    show(this.root, true);
    this.root.dataset["tone"] = notice.tone;
    say(this.title, notice.title);
    say(this.text, notice.text);
    show(this.reload, notice.action === "reload");
    show(this.wait, notice.action === "wait");
    show(this.dismiss, notice.action === "dismiss" || notice.action === "wait"); // a visitor who does not wait may watch
  }
}
