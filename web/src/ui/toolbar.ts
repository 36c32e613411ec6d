/** The top line: the name of the body, the state of the connection, and buttons for the view. */

import { isLive, type SceneStore } from "../model/scene";
import { el, iconButton, say, show } from "./dom";
import { icon } from "./icons";
import { period } from "./notice";

export interface ToolbarActions {
  readonly tour: () => void;
  readonly replay: () => void;
  readonly reset: () => void;
  readonly full: () => void;
  readonly theme: () => void;
  readonly panel: () => void;
  readonly help: () => void;
  readonly upload: () => void;
  /** Button for a gamepad; hidden if the browser cannot use one. */
  readonly gamepad: HTMLButtonElement;
}

export class Toolbar {
  readonly root: HTMLElement;
  readonly panelButton: HTMLButtonElement;
  private readonly uploadButton: HTMLButtonElement;
  private readonly room = el("span", { class: "room" });
  private readonly lamp = el("span", { class: "lamp", attrs: { "aria-hidden": "true" } });

  constructor(actions: ToolbarActions) {
    const tour = el(
      "button",
      { class: "button tour-button", attrs: { type: "button", "aria-label": "Guided tour", "aria-keyshortcuts": "G" }, on: { click: actions.tour } },
      icon("play"),
      el("span", { text: "Guided tour", class: "tour-long" }),
      el("span", { text: "Tour", class: "tour-short", attrs: { "aria-hidden": "true" } }),
    );
    this.panelButton = iconButton(icon("panel"), "Hands and plots", "", actions.panel);
    this.panelButton.classList.add("panel-button");
    this.uploadButton = iconButton(icon("upload"), "An object of your own", "", actions.upload);
    this.uploadButton.hidden = true;
    const full = iconButton(icon("full"), "Full screen", "F", actions.full);
    // Some phones have no full screen.
    full.hidden = !document.fullscreenEnabled;
    this.root = el(
      "header",
      { class: "bar" },
      el("h1", { class: "brand", text: "cohaptic" }),
      this.lamp,
      this.room,
      el("span", { class: "spring" }),
      tour,
      this.uploadButton,
      actions.gamepad,
      iconButton(icon("replay"), "Look back at the last minute", "B", actions.replay),
      iconButton(icon("reset"), "First view again", "R", actions.reset),
      full,
      iconButton(icon("sun"), "Day or night", "D", actions.theme),
      iconButton(icon("help"), "Help", "?", actions.help),
      this.panelButton,
    );
  }

  /** @param replay Words of a replay in place of the body's name; empty for none. */
  update(store: SceneStore, replay: string): void {
    const info = store.info;
    const name = info?.body.name ?? "";
    say(this.room, replay !== "" ? replay : info === null || isLive(store.status) ? name : `no word for ${period(store.status.silent)}`);
    show(this.uploadButton, info?.allow_upload === true);
    const silent = store.status.phase === "watching" && !isLive(store.status);
    this.lamp.dataset["phase"] = replay !== "" ? "replay" : silent ? "silent" : store.status.phase;
  }
}
