/** The controls of the replay: a timeline with pause, steps, speed, outlines for delay, and the return to live. */

import type { Speed } from "../../replay/scrubber";
import { type Choice, choice, el, iconButton, say, show } from "../dom";
import { icon } from "../icons";

export interface BarActions {
  /** Go to a share of the recording, 0 to 1. */
  readonly seek: (share: number) => void;
  readonly playing: () => void;
  readonly step: (by: 1 | -1) => void;
  readonly pace: (speed: Speed) => void;
  readonly delay: () => void;
  readonly live: () => void;
  readonly close: () => void;
}

/** State that the bar shows. */
export interface BarState {
  /** Whether a past time is shown. */
  readonly replaying: boolean;
  readonly playing: boolean;
  /** Whether the server is heard now. */
  readonly live: boolean;
  /** Share of the shown time in the recording, 0 to 1. */
  readonly share: number;
  readonly when: string;
  /** Words on a problem; empty for none. */
  readonly trouble: string;
  readonly delay: boolean;
  readonly delayWords: string;
}

const PAUSE = "M7 4.8v10.4M13 4.8v10.4";
const BACK = "M13.4 4.8v10.4L6.6 10zM4.6 4.8v10.4";
const ON = "M6.6 4.8v10.4l6.8-5.2zM15.4 4.8v10.4";
const PACES: readonly (readonly [string, string, string])[] = [
  ["1", "1", "As fast as it was"], ["0.25", "\u00bc", "A quarter as fast"], ["0.1", "1/10", "A tenth as fast"],
];

export class ReplayBar {
  readonly root: HTMLElement;
  private readonly tag = el("strong", { class: "replay-tag", attrs: { role: "status" } });
  private readonly when = el("span", { class: "replay-when" });
  private readonly trouble = el("span", { class: "replay-trouble" });
  private readonly line: HTMLInputElement;
  private readonly play: HTMLButtonElement;
  private readonly steps: readonly HTMLButtonElement[];
  private readonly paces: Choice<string>;
  private readonly delay: HTMLButtonElement;
  private readonly delayWords = el("p", { class: "replay-delay" });
  private readonly back: HTMLButtonElement;

  constructor(actions: BarActions) {
    this.line = el("input", {
      class: "replay-line",
      attrs: { type: "range", min: "0", max: "1", step: "any", value: "1", "aria-label": "Time in the last minute" },
      on: { input: () => { actions.seek(Number(this.line.value)); } },
    });
    this.play = iconButton(icon(PAUSE), "Pause", "B", actions.playing);
    this.play.classList.add("replay-play");
    this.steps = [
      iconButton(icon(BACK), "A frame back", "\u2190", () => { actions.step(-1); }),
      iconButton(icon(ON), "A frame on", "\u2192", () => { actions.step(1); }),
    ];
    this.paces = choice<string>("Pace of the replay", PACES, (pace) => { actions.pace(Number(pace) as Speed); });
    this.paces.set("1");
    this.delay = el("button", {
      class: "button replay-small", text: "Delay",
      title: "Outline each hand where its delay puts it (L)",
      attrs: { type: "button", "aria-pressed": "false", "aria-keyshortcuts": "L" }, on: { click: actions.delay },
    });
    this.back = el("button", { class: "button primary replay-small", text: "Back to live", attrs: { type: "button" }, on: { click: actions.live } });
    const [before, after] = this.steps;
    const close = iconButton(icon("close"), "Close, and back to live", "", actions.close);
    close.classList.add("replay-close");
    this.root = el(
      "section",
      { class: "replay", attrs: { "aria-label": "The last minute" } },
      el("div", { class: "replay-head" }, this.tag, this.when, this.trouble, el("span", { class: "spring" }), this.delay, this.back, close),
      el("div", { class: "replay-controls" }, before ?? null, this.play, after ?? null, this.line, this.paces.root),
      this.delayWords,
    );
  }

  /** Height of the bar [px]. */
  get height(): number {
    return this.root.offsetHeight;
  }

  set(state: BarState): void {
    const { replaying, playing } = state;
    say(this.tag, replaying ? "Replay" : state.live ? "Live" : "No word");
    this.root.classList.toggle("on", replaying);
    say(this.when, state.when);
    say(this.trouble, state.trouble);
    show(this.trouble, state.trouble !== "");
    // The slider does not move under a finger that holds it.
    if (!this.line.matches(":active")) this.line.value = `${state.share}`;
    this.line.setAttribute("aria-valuetext", replaying ? state.when : "now");
    this.line.style.setProperty("--share", `${(100 * state.share).toFixed(1)}%`);
    const [picture, words] = !replaying || playing ? [icon(PAUSE), "Pause"] as const : [icon("play"), "Play"] as const;
    if (this.play.getAttribute("aria-label") !== words) {
      this.play.replaceChildren(picture);
      this.play.setAttribute("aria-label", words);
      this.play.title = replaying ? `${words} (Space)` : `${words} (B)`;
    }
    show(this.back, replaying);
    this.delay.setAttribute("aria-pressed", `${state.delay}`);
    say(this.delayWords, state.delayWords);
    show(this.delayWords, state.delayWords !== "");
  }

  setPace(speed: Speed): void {
    this.paces.set(`${speed}`);
  }
}
