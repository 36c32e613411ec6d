/** The top line: the name of the body, the state of the connection, and buttons for the view. */

import { isLive, type SceneStore } from "../model/scene";
import { el, iconButton, say, show } from "./dom";
import { icon } from "./icons";
import type { KeyAction } from "./keyboard";
import { period } from "./notice";

export class Toolbar {
  readonly root: HTMLElement;
  readonly panelButton: HTMLButtonElement;
  /** The button before which others may stand that are no button of the page itself. */
  readonly end: HTMLButtonElement;
  private readonly room = el("span", { class: "room" });
  private readonly record = el("span", { class: "on-record", text: "recorded", attrs: { role: "status", title: "The server records this session" } });
  private readonly lamp = el("span", { class: "lamp", attrs: { "aria-hidden": "true" } });

  /**
   * @param act Does what a key does.
   * @param replay Shows or hides the replay's bar.
   * @param column Shows or hides the column.
   */
  constructor(act: (action: KeyAction) => void, replay: () => void, column: () => void) {
    const tour = el(
      "button",
      { class: "button tour-button", attrs: { type: "button", "aria-label": "Guided tour", "aria-keyshortcuts": "G" }, on: { click: () => { act("tour"); } } },
      icon("play"),
      el("span", { text: "Guided tour", class: "tour-long" }),
      el("span", { text: "Tour", class: "tour-short", attrs: { "aria-hidden": "true" } }),
    );
    this.panelButton = iconButton(icon("panel"), "Hands and plots", "", column);
    this.panelButton.classList.add("panel-button");
    this.end = iconButton(icon("replay"), "Look back at the last minute", "B", replay);
    const full = iconButton(icon("full"), "Full screen", "F", () => { act("full"); });
    // Some phones have no full screen.
    full.hidden = !document.fullscreenEnabled;
    this.root = el(
      "header",
      { class: "bar" },
      el("h1", { class: "brand", text: "cohaptic" }),
      this.lamp,
      this.room,
      this.record,
      el("span", { class: "spring" }),
      tour,
      this.end,
      iconButton(icon("reset"), "First view again", "R", () => { act("reset"); }),
      full,
      iconButton(icon("sun"), "Day or night", "D", () => { act("theme"); }),
      iconButton(icon("help"), "Help", "?", () => { act("help"); }),
      this.panelButton,
    );
  }

  /** @param replay Words of a replay in place of the body's name; empty for none. */
  update(store: SceneStore, replay: string): void {
    const info = store.info;
    const name = info?.body.name ?? "";
    say(this.room, replay !== "" ? replay : info === null || isLive(store.status) ? name : `no word for ${period(store.status.silent)}`);
    show(this.record, store.onRecord);
    const silent = store.status.phase === "watching" && !isLive(store.status);
    this.lamp.dataset["phase"] = replay !== "" ? "replay" : silent ? "silent" : store.status.phase;
  }
}
