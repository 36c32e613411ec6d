/** The dock of the own hand: joining and leaving, law, friction, and the force. */

import type { TouchState } from "../model/hand";
import { DEFAULT_LAW, type LawChoice, type LawName } from "../model/laws";
import { forceShare, FULL_FORCE } from "../model/scale";
import { norm } from "../model/vec";
import { type Choice, choice, el, say, show, symbol } from "./dom";
import { icon } from "./icons";
import { CutPicture } from "./plots/cut_picture";
import type { Inks } from "./plots/canvas";
import { fixed, LAW_WORDS, millimetres } from "./words";

/** Choices for mu of the finger. */
type Roughness = "0" | "0.4" | "0.8";

export interface DockActions {
  touch(on: boolean): void;
  law(law: LawChoice): void;
  friction(mu: number): void;
  name(name: string): void;
}

export class Dock {
  readonly root: HTMLElement;
  private readonly main = el("div", { class: "dock-main" });
  private readonly button: HTMLButtonElement;
  private readonly words = el("span", { class: "touch-words", text: "Touch it" });
  private readonly name: HTMLInputElement;
  private readonly laws: Choice<LawChoice>;
  private readonly active = el("div", { class: "dock-active" });
  private readonly force = el("output", { class: "dock-force", attrs: { "aria-label": "Force on your hand" } });
  private readonly meter: HTMLElement;
  private readonly fill = el("span", { class: "meter-fill" });
  private readonly share = el("span", { class: "meter-others", title: "Share of the force that comes from the others" });
  private readonly facts = el("p", { class: "dock-facts" });
  private readonly people = el("p", { class: "dock-people" });
  private readonly hint = el("p", { class: "dock-hint" });
  private readonly picture = new CutPicture();
  private on = false;

  constructor(name: string, actions: DockActions) {
    this.name = el("input", {
      class: "name",
      attrs: { type: "text", maxlength: "32", "aria-label": "Your name", placeholder: "Your name", spellcheck: "false", autocomplete: "nickname" },
    });
    this.name.value = name;
    this.name.addEventListener("change", () => { actions.name(this.name.value); });
    this.button = el(
      "button",
      { class: "touch-button", attrs: { type: "button", "aria-pressed": "false", "aria-keyshortcuts": "T" }, on: { click: () => { actions.touch(!this.on); } } },
      icon("touch"),
      this.words,
    );
    this.laws = choice<LawChoice>(
      "Local model of your hand",
      [
        ...(Object.keys(LAW_WORDS) as LawName[]).map((law): [LawName, string, string] => [law, ...LAW_WORDS[law]]),
        ["paper", "Paper\u2019s rule", "Proportional with K_h just below K_o of this contact alone: the rule for one user"],
      ],
      (law) => { actions.law(law); },
    );
    this.laws.set(DEFAULT_LAW);
    const friction = choice<Roughness>(
      "Friction of your finger",
      [
        ["0", "Smooth", "No friction: the finger slides"],
        ["0.4", "0.4", "Friction 0.4: the finger sticks until pushed aside by 0.4 of its pressure, and others drag it along"],
        ["0.8", "0.8", "Friction 0.8: rubber; the finger sticks, and others drag it along"],
      ],
      (mu) => { actions.friction(Number(mu)); },
    );
    friction.set("0");
    this.meter = el("div", {
      class: "meter",
      attrs: { role: "meter", "aria-label": "Force on your hand", "aria-valuemin": "0", "aria-valuemax": `${FULL_FORCE}`, "aria-valuenow": "0" },
    }, this.fill, this.share);
    this.active.append(
      this.picture.canvas,
      el("div", { class: "dock-numbers" }, this.force, this.meter, this.people, this.facts),
      el("div", { class: "dock-law" }, this.laws.root, el("div", { class: "dock-friction" }, el("span", { text: "Friction", attrs: { "aria-hidden": "true" } }), friction.root)),
    );
    this.main.append(this.button, this.name, this.active);
    this.root = el("section", { class: "dock", attrs: { "aria-label": "Your hand" } }, this.main, this.hint);
    this.set(false, "");
  }

  /** Height of the controls [px], without the line of the hint above them, which comes and goes. */
  get height(): number {
    return this.main.offsetHeight;
  }

  /** Show whether the hand is in the room, with a hint. */
  set(on: boolean, hint: string): void {
    this.on = on;
    this.root.classList.toggle("on", on);
    this.button.setAttribute("aria-pressed", `${on}`);
    say(this.words, on ? "Let go" : "Touch it");
    show(this.active, on);
    say(this.hint, hint);
    show(this.hint, hint !== "");
  }

  setName(name: string): void {
    this.name.value = name;
  }

  setLaw(law: LawChoice): void {
    this.laws.set(law);
  }

  /**
   * @param touch Whether this visitor may touch; otherwise the visitor only watches.
   * @param paper Whether the hand may have fixed gains.
   */
  allow(touch: boolean, paper: boolean): void {
    this.laws.enable("paper", paper);
    if (this.button.disabled === !touch) return; // a title that is written again may leave the screen
    this.button.disabled = !touch;
    this.button.title = touch ? "" : "Your invitation lets you watch, not touch";
  }

  /** @param live Whether the server is heard: without patches the loop's force is not that of the object. */
  update(state: TouchState, live: boolean, colour: string, ink: Inks): void {
    const f = live ? norm(state.force) : 0;
    const others = Math.max(0, Math.min(f, state.felt_from_others));
    say(this.force, live ? `${fixed(f, 2)} N` : "\u2013");
    this.fill.style.transform = `scaleX(${forceShare(f).toFixed(3)})`;
    this.share.style.transform = `scaleX(${forceShare(others).toFixed(3)})`;
    this.meter.setAttribute("aria-valuenow", f.toFixed(1));
    this.meter.setAttribute("aria-valuetext", `${f.toFixed(1)} newtons, ${others.toFixed(1)} of them from the others`);
    say(this.people, live ? placeWords(state) : "no word from the server");
    this.facts.replaceChildren(...(live ? factWords(state) : ["no word from the server"]));
    this.root.style.setProperty("--user", colour);
    this.picture.draw(state, colour, ink);
  }
}

/** Words on where the hand is. */
function placeWords(state: TouchState): string {
  if (state.doing === "touching") return `${millimetres(state.depth)} deep`;
  return state.doing === "free" ? "in the air" : state.doing;
}

function factWords(state: TouchState): (Node | string)[] {
  if (state.doing !== "touching") return [placeWords(state)];
  // With friction the line has no room for the gain: the tangential force replaces it.
  const more = state.along > 0 ? [`${fixed(state.along, 2)} N along`] : [symbol("K", "h"), ` ${fixed(state.k_h, 0)} N/m`];
  return [`${placeWords(state)} \u00b7 ${fixed(state.felt_from_others, 2)} N from others \u00b7 `, ...more];
}
