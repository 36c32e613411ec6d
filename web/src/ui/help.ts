/** The help dialog. */

import { el } from "./dom";
import { icon } from "./icons";
import { type KeyAction, SHORTCUTS } from "./keyboard";

/** Key and words of each action, as the help shows them; null where the line of another key covers it. */
const WORDS: Readonly<Record<KeyAction, readonly [string, string] | null>> = {
  left: ["\u2190 \u2192 \u2191 \u2193", "turn the view"],
  right: null,
  up: null,
  down: null,
  closer: ["+ \u2212", "closer, farther"],
  farther: null,
  reset: ["R", "first view again"],
  full: ["F", "full screen"],
  touch: ["T", "touch, let go"],
  press: ["Space", "press in the middle of the view while held"],
  deeper: ["[ ] , .", "press less, more"],
  shallower: null,
  tour: ["G", "guided tour"],
  replay: ["B", "look back at the last minute, and back to live"],
  delay: ["L", "outline hands where their delay puts them"],
  point: ["P", "point at the middle of the view, for everybody to see"],
  follow: ["V", "see what the next person sees, then your own view again"],
  theme: ["D", "day, night"],
  help: ["?", "this list"],
  escape: ["Esc", "close, let go"],
};

/** Keys of a recorded session, and actions of the page that are left there. */
const SESSION_KEYS: readonly (readonly [string, string])[] = [
  ["Space", "play, pause"], ["\u2190 \u2192", "a frame back, on"], ["Shift \u2190 \u2192", "a second back, on"],
  ["N", "to the next mark or event"], ["Shift N", "to the one before"], ["Home End", "to the beginning, to the end"],
];
const IN_SESSIONS: readonly KeyAction[] = ["left", "closer", "reset", "full", "delay", "theme", "help"];

/** Keys of a replay and their effects, as the help shows them. */
const REPLAY_KEYS: readonly (readonly [string, string])[] = [
  ["Space", "play, pause"], ["\u2190 \u2192", "a frame back, on"], ["Shift \u2190 \u2192", "a second back, on"],
  ["Home End", "to the oldest, to the newest"], ["Esc", "back to live"],
];

export class Help {
  readonly root: HTMLDialogElement;

  /** @param session Whether the page shows a recorded session. */
  constructor(session = false) {
    const rows = SHORTCUTS.flatMap(({ action }) => {
      const told = session && !IN_SESSIONS.includes(action) ? null : WORDS[action];
      return told === null ? [] : [row(...told)];
    });
    const close = el(
      "button",
      { class: "icon-button dialog-close", attrs: { type: "button", "aria-label": "Close" }, on: { click: () => { this.root.close(); } } },
      icon("close"),
    );
    this.root = el(
      "dialog",
      { class: "dialog", id: "help", attrs: { "aria-labelledby": "help-title" } },
      close,
      el("h2", { id: "help-title", text: "One object, many hands" }),
      el("p", {
        text: "Everybody who touches the object feels the others through it, however far away they are. Each hand has a tip, "
          + "a stem with a name, an arrow as long as the force on it, and a sheet: the surface that its own haptic loop presses "
          + "on between two messages of the server.",
      }),
      ...(session ? [] : [el("h3", { text: "Touch" }), el("p", {
        text: "Press on the object and hold: that brings your hand in. Drag to slide. The wheel, Shift with a drag, a pen\u2019s "
          + "pressure or a second finger go deeper. With friction your finger sticks, and others drag it along. Beside the object a "
          + "drag turns the view; two fingers or the wheel zoom.",
      })]),
      el("h3", { text: "Keys" }),
      el("p", { text: "With another alphabet, each letter is the key that a Latin keyboard has in its place." }),
      el("dl", { class: "keys" }, ...rows),
      el("h3", { text: "Keys of the replay" }),
      session ? null : el("p", {
        text: "The page keeps the last minute of what it received. While it shows a time of before, the picture has a frame and no "
          + "full colour; your own hand lets go of the object, stays in the room, and its force in the dock is that of now.",
      }),
      el("dl", { class: "keys" }, ...(session ? SESSION_KEYS : REPLAY_KEYS).map(([keys, words]) => row(keys, words))),
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

function row(keys: string, words: string): HTMLElement {
  return el("div", {}, el("dt", {}, ...keys.split(" ").map((key) => el("kbd", { text: key }))), el("dd", { text: words }));
}
