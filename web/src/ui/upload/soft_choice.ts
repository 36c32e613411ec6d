/** Choice of the object's softness: a slider, and names of familiar materials. */

import { MATERIALS, positionOf, softnessWords, STEPS, youngAt } from "../../upload/softness";
import { el, say } from "../dom";
import { sentence } from "../notice";
import { Section } from "./section";

const PROPOSED = 2e4; // Pa

export class SoftChoice extends Section {
  private readonly slider = el("input", { attrs: { type: "range", min: "0", max: `${STEPS}`, step: "1", "aria-label": "How soft" } });
  private readonly words = el("output", { class: "upload-soft" });

  constructor() {
    super("How soft it is", "soft");
    this.slider.addEventListener("input", () => { this.tell(); });
    const names = MATERIALS.map(({ name, young }) =>
      el("button", { class: "button small", text: name, attrs: { type: "button" }, on: { click: () => { this.set(young); } } }));
    this.fill(el("div", { class: "upload-names" }, ...names), this.slider, this.words);
    this.control = this.slider;
  }

  /** Young's modulus [Pa]. */
  get young(): number {
    return youngAt(Number(this.slider.value));
  }

  propose(): void {
    this.set(PROPOSED);
  }

  private set(young: number): void {
    this.slider.value = `${positionOf(young)}`;
    this.tell();
  }

  private tell(): void {
    const words = sentence(softnessWords(this.young));
    say(this.words, words);
    this.slider.setAttribute("aria-valuetext", words);
  }
}
