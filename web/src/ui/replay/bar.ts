/** The controls of the replay: a timeline with pause, steps, speed, outlines for delay, and the return to live. */

import type { RecordedSession } from "../../model/recording";
import { SESSION_SPEEDS, type Speed } from "../../replay/scrubber";
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
  /** Go to the next moment of a session, or to the one before. */
  readonly jump: (by: 1 | -1) => void;
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
  /** Words of the moment of a session that was reached last; empty for none. */
  readonly moment: string;
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

const NEXT = "M4.4 5v10l5-5zM10.4 5v10l5-5zM16.4 5v10";
const PREVIOUS = "M15.6 5v10l-5-5zM9.6 5v10l-5-5zM3.6 5v10";
const WORDS: Readonly<Record<number, string>> = { 0.1: "1/10", 0.25: "\u00bc" };
const SESSION_PACES = SESSION_SPEEDS.map((speed) => [`${speed}`, WORDS[speed] ?? `${speed}`, speed < 1 ? `${WORDS[speed] ?? ""} as fast as it was` : speed === 1 ? "As fast as it was" : `${speed} times as fast as it was`] as const);
const MARKS = 400; // on the line; more would lie on each other

export class ReplayBar {
  readonly root: HTMLElement;
  private readonly tag = el("strong", { class: "replay-tag", attrs: { role: "status" } });
  private readonly when = el("span", { class: "replay-when" });
  private readonly moment = el("span", { class: "replay-moment" });
  private readonly trouble = el("span", { class: "replay-trouble" });
  private readonly line: HTMLInputElement;
  private readonly play: HTMLButtonElement;
  private readonly steps: readonly HTMLButtonElement[];
  private readonly paces: Choice<string>;
  private readonly delay: HTMLButtonElement;
  private readonly delayWords = el("p", { class: "replay-delay" });
  private readonly back: HTMLButtonElement;

  /** @param session The recorded session whose moments are on the line; null for the last minute. */
  constructor(actions: BarActions, private readonly session: RecordedSession | null) {
    this.line = el("input", {
      class: "replay-line",
      attrs: { type: "range", min: "0", max: "1", step: "any", value: "1", "aria-label": session === null ? "Time in the last minute" : "Time in the session" },
      on: { input: () => { actions.seek(Number(this.line.value)); } },
    });
    this.play = iconButton(icon(PAUSE), "Pause", "B", actions.playing);
    this.play.classList.add("replay-play");
    this.steps = [
      iconButton(icon(BACK), "A frame back", "\u2190", () => { actions.step(-1); }),
      iconButton(icon(ON), "A frame on", "\u2192", () => { actions.step(1); }),
    ];
    this.paces = choice<string>("Pace of the replay", session === null ? PACES : SESSION_PACES, (pace) => { actions.pace(Number(pace) as Speed); });
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
    const jumps = session === null ? [] : [
      iconButton(icon(PREVIOUS), "To the mark or event before", "Shift N", () => { actions.jump(-1); }),
      iconButton(icon(NEXT), "To the next mark or event", "N", () => { actions.jump(1); }),
    ];
    const [previous, next] = jumps;
    for (const button of jumps) button.disabled = session?.moments.length === 0;
    show(close, session === null);
    this.root = el(
      "section",
      { class: "replay", attrs: { "aria-label": session === null ? "The last minute" : "The session" } },
      el("div", { class: "replay-head" }, this.tag, this.when, this.moment, this.trouble, el("span", { class: "spring" }), this.delay, this.back, close),
      el("div", { class: "replay-controls" }, previous ?? null, before ?? null, this.play, after ?? null, next ?? null,
        session === null ? this.line : el("div", { class: "replay-track" }, this.line, marksOf(session)), this.paces.root),
      this.delayWords,
    );
  }

  /** Height of the bar [px]. */
  get height(): number {
    return this.root.offsetHeight;
  }

  set(state: BarState): void {
    const { replaying, playing } = state;
    say(this.tag, replaying ? (this.session === null ? "Replay" : "Recorded") : state.live ? "Live" : "No word");
    this.root.classList.toggle("on", replaying);
    say(this.when, state.when);
    say(this.moment, state.moment);
    show(this.moment, state.moment !== "");
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
    show(this.back, replaying && this.session === null);
    this.delay.setAttribute("aria-pressed", `${state.delay}`);
    say(this.delayWords, state.delayWords);
    show(this.delayWords, state.delayWords !== "");
  }

  setPace(speed: Speed): void {
    this.paces.set(`${speed}`);
  }
}

/** The moments of a session as strokes on its line; of those that would lie on each other, one. */
function marksOf({ first, last, moments }: RecordedSession): HTMLElement {
  const shown = new Map<number, string>();
  for (const { t, kind } of moments) {
    const at = Math.round((MARKS * (t - first)) / Math.max(1e-9, last - first));
    // Of people who come and go there are many: a mark or an event is not hidden behind them.
    if (at >= 0 && at <= MARKS && (!shown.has(at) || (kind !== "joined" && kind !== "left"))) shown.set(at, kind);
  }
  const root = el("div", { class: "replay-marks", attrs: { "aria-hidden": "true" } });
  for (const [at, kind] of shown) {
    const mark = el("span", { class: `replay-mark ${kind}` });
    mark.style.setProperty("--at", `${at / MARKS}`);
    root.append(mark);
  }
  return root;
}
