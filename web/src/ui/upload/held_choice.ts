/** Choice of the held part of the object: a layer at one of its sides, or the painted part. */

import type { Vec3 } from "../../model/vec";
import { layerOf, layerRule, type Layer, type Painting } from "../../upload/held";
import { choice, el, say, show } from "../dom";
import { Section } from "./section";

type Side = "+x" | "-x" | "+y" | "-y" | "+z" | "-z" | "paint";

const SIDES: readonly (readonly [Side, string, string])[] = [
  ["-z", "Bottom", "The lowest part, along z"],
  ["+z", "Top", "The highest part, along z"],
  ["-x", "Left", "The low end along x"],
  ["+x", "Right", "The high end along x"],
  ["-y", "Front", "The low end along y"],
  ["+y", "Back", "The high end along y"],
  ["paint", "Paint", "Drag over the object"],
];
const PROPOSED: Layer = { axis: 2, sign: -1, share: 10 };

export interface HeldActions {
  /** Called when another part is held; null for the painted part. */
  readonly held: (layer: Layer | null) => void;
  readonly cleared: () => void;
}

export class HeldChoice extends Section {
  private readonly sides = choice<Side>("What is held", SIDES, (side) => { this.pick(side); });
  private readonly share = el("input", { attrs: { type: "range", min: "1", max: "50", step: "1", "aria-label": "How much is held" } });
  private readonly shareWords = el("output", { class: "slider-value" });
  private readonly shareRow: HTMLElement;
  private readonly paintRow: HTMLElement;
  private layer: Layer = PROPOSED;
  private painting: Painting | null = null;
  private middle: Vec3 = [0, 0, 0];
  private painted = false;

  constructor(private readonly actions: HeldActions) {
    super("What is held", "held");
    this.share.addEventListener("input", () => { this.hold({ ...this.layer, share: Number(this.share.value) }); });
    this.shareRow = el("label", { class: "slider" }, el("span", { text: "How much" }), this.share, this.shareWords);
    const clear = el("button", { class: "button", text: "Clear", attrs: { type: "button" }, on: { click: () => { this.clear(); } } });
    this.paintRow = el("div", { class: "upload-row" }, el("span", { class: "fine", text: "Drag over the object. Beside it a drag turns the view." }), clear);
    this.fill(this.sides.root, this.shareRow, this.paintRow);
    this.control = this.share;
  }

  /** Begin with another object that is shown about `middle` of its file [m], with the held part that the server proposes. */
  propose(rule: string, middle: Vec3): void {
    this.middle = middle;
    const layer = layerOf(rule) ?? PROPOSED;
    this.sides.set(sideOf(layer));
    this.painted = false;
    this.hold(layer);
  }

  /** To be called when the painted part has changed. */
  paint(painting: Painting | null): void {
    this.painting = painting;
    this.refuse("");
  }

  /** Whether something is held. */
  get possible(): boolean {
    return !this.painted || this.painting?.empty === false;
  }

  /** Rule for the server, for an object `larger` times as large as shown; null if it is too long for the server. */
  rule(larger: number): string | null {
    return this.painted ? (this.painting?.rule(larger, this.middle) ?? null) : layerRule(this.layer);
  }

  override focus(): void {
    this.control = this.painted ? this.paintRow.querySelector("button") : this.share;
    super.focus();
  }

  private clear(): void {
    this.painting?.clear();
    this.refuse("");
    this.actions.cleared();
  }

  private pick(side: Side): void {
    this.painted = side === "paint";
    if (side === "paint") {
      this.actions.held(null);
      this.rows();
    } else {
      this.hold({ axis: "xyz".indexOf(side.charAt(1)), sign: side.startsWith("-") ? -1 : 1, share: this.layer.share });
    }
  }

  private hold(layer: Layer): void {
    this.layer = layer;
    this.share.value = `${layer.share}`;
    say(this.shareWords, `${layer.share} %`);
    this.share.setAttribute("aria-valuetext", `${layer.share} %`);
    this.actions.held(layer);
    this.rows();
  }

  private rows(): void {
    this.refuse("");
    show(this.shareRow, !this.painted);
    show(this.paintRow, this.painted);
  }
}

function sideOf({ axis, sign }: Layer): Side {
  return `${sign < 0 ? "-" : "+"}${"xyz".charAt(axis) as "x" | "y" | "z"}`;
}
