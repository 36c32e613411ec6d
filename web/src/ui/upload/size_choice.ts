/** Choice of the object's size: by the unit of its file, or by a length. */

import type { Vec3 } from "../../model/vec";
import { LARGEST, sizeWords, SMALLEST, touchable, type Unit, UNITS, unitOf } from "../../upload/size";
import { choice, el, say } from "../dom";
import { Section } from "./section";

const NAMES: readonly (readonly [Unit, string, string])[] = [
  ["mm", "mm", "The file is in millimetres"],
  ["cm", "cm", "The file is in centimetres"],
  ["m", "m", "The file is in metres"],
  ["inch", "inch", "The file is in inches"],
];

export class SizeChoice extends Section {
  private readonly units = choice<Unit>("Unit of the file", NAMES, (unit) => { this.scaleTo(UNITS[unit]); });
  private readonly longest = el("input", {
    class: "upload-length",
    attrs: { type: "number", min: `${100 * SMALLEST}`, max: `${100 * LARGEST}`, step: "any", inputmode: "decimal", "aria-describedby": "upload-size-words" },
  });
  private readonly words = el("p", { class: "fine", id: "upload-size-words", attrs: { "aria-live": "polite" } });
  /** Sides of the box round the object, in units of the file. */
  private sides: Vec3 = [1, 1, 1];
  /** Metres in one unit of the file. */
  scale = 1;

  /** @param changed Called with each new scale. */
  constructor(private readonly changed: (scale: number) => void) {
    super("How large it is", "size");
    this.longest.addEventListener("input", () => { this.typed(); });
    this.longest.addEventListener("change", () => { this.write(); });
    this.fill(this.units.root,
      el("label", { class: "upload-row" }, el("span", { text: "Longest side" }), el("span", { class: "upload-unit" }, this.longest, el("span", { text: "cm" }))),
      this.words);
    this.control = this.longest;
  }

  /** Begin with another object and its proposed scale. @param sides Sides of its box at that scale [m]. */
  propose(scale: number, sides: Vec3): void {
    this.sides = sides.map((side) => side / scale) as unknown as Vec3;
    this.scaleTo(scale);
  }

  get possible(): boolean {
    return touchable(this.scale * Math.max(...this.sides));
  }

  private scaleTo(scale: number): void {
    this.scale = scale;
    this.write();
    this.tell();
  }

  private typed(): void {
    const metres = 0.01 * Number(this.longest.value);
    // The sides, in single precision, have no more digits.
    const scale = Number((metres / Math.max(...this.sides)).toPrecision(6));
    // A number that is still being typed does not count.
    if (!(scale >= 1e-9 && scale <= 1e9)) return;
    this.scale = scale;
    this.tell();
  }

  private write(): void {
    this.longest.value = `${Number((100 * this.scale * Math.max(...this.sides)).toPrecision(3))}`;
  }

  private tell(): void {
    this.refuse("");
    this.units.set(unitOf(this.scale));
    say(this.words, sizeWords(this.sides.map((side) => this.scale * side) as unknown as Vec3));
    this.words.classList.toggle("wrong", !this.possible);
    this.longest.setAttribute("aria-invalid", `${!this.possible}`);
    this.changed(this.scale);
  }
}
