/** Choice of the object's softness: a slider, and names of familiar materials. */

import { MATERIALS, positionOf, softnessWords, STEPS, youngAt } from "../../upload/softness";
import { el, say } from "../dom";
import { sentence } from "../notice";
import { Section } from "./section";

const START = 2e4; // Pa; position of the slider before the visitor moves it
const FELT = "Chosen while it is prepared, so that a press is felt";

export class SoftChoice extends Section {
  private readonly slider = el("input", { attrs: { type: "range", min: "0", max: `${STEPS}`, step: "1", "aria-label": "How soft" } });
  private readonly words = el("output", { class: "upload-soft" });
  private felt = true;

  constructor() {
    super("How soft it is", "soft");
    this.slider.addEventListener("input", () => { this.choose(); });
    const press = (name: string, act: () => void): HTMLButtonElement =>
      el("button", { class: "button small", text: name, attrs: { type: "button" }, on: { click: act } });
    const names = MATERIALS.map(({ name, young }) => press(name, () => { this.set(young); this.choose(); }));
    this.fill(el("div", { class: "upload-names" }, press("choose for me", () => { this.propose(); }), ...names), this.slider, this.words);
    this.control = this.slider;
  }

  /** Young's modulus [Pa]; null for one with which a press is felt. */
  get young(): number | null {
    return this.felt ? null : youngAt(Number(this.slider.value));
  }

  propose(): void {
    this.felt = true;
    this.set(START);
    this.tell();
  }

  private set(young: number): void {
    this.slider.value = `${positionOf(young)}`;
  }

  private choose(): void {
    this.felt = false;
    this.tell();
  }

  private tell(): void {
    const words = sentence(this.young === null ? FELT : softnessWords(this.young));
    say(this.words, words);
    this.slider.setAttribute("aria-valuetext", words);
  }
}
