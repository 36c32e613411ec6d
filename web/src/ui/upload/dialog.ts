/** The dialog in which a visitor brings an object: choose a file, look at it, say what is held and how soft it is, wait. */

import { layerOf, layerRule, type Layer, type Painting } from "../../upload/held";
import { positionOf, softnessWords, STEPS, youngAt, MATERIALS } from "../../upload/softness";
import type { UploadNews } from "../../upload/client";
import { choice, el, say, show } from "../dom";
import { icon } from "../icons";
import { sentence } from "../notice";

type Side = "+x" | "-x" | "+y" | "-y" | "+z" | "-z" | "paint";

/** The actions of the dialog. */
export interface UploadActions {
  readonly chosen: (file: File) => void;
  readonly prepare: (rule: string, young: number) => void;
  readonly cancel: () => void;
  /** Another part is held. */
  readonly held: (layer: Layer | null) => void;
  readonly cleared: () => void;
}

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

export class UploadDialog {
  readonly root: HTMLDialogElement;
  /** Holds the picture. */
  readonly host = el("div", { class: "upload-host", attrs: { tabindex: "0", "aria-label": "The object before it is prepared. Drag turns it." } });
  private readonly file = el("input", { class: "for-ears", attrs: { type: "file", "aria-label": "Mesh file" } });
  private readonly drop: HTMLElement;
  private readonly work: HTMLElement;
  private readonly wait: HTMLElement;
  private readonly bar = el("progress", { class: "upload-bar", attrs: { max: "1" } });
  private readonly phase = el("p", { class: "upload-phase", attrs: { role: "status" } });
  private readonly words = el("p", { class: "upload-words", attrs: { role: "alert" } });
  private readonly findings = el("ul", { class: "upload-findings" });
  private readonly share = el("input", { attrs: { type: "range", min: "1", max: "50", step: "1", "aria-label": "How much is held" } });
  private readonly shareWords = el("output", { class: "slider-value" });
  private readonly shareRow: HTMLElement;
  private readonly paintRow: HTMLElement;
  private readonly sides;
  private readonly soft = el("input", { attrs: { type: "range", min: "0", max: `${STEPS}`, step: "1", "aria-label": "How soft" } });
  private readonly softWords = el("output", { class: "upload-soft" });
  private readonly go: HTMLButtonElement;
  private readonly again: HTMLButtonElement;
  private readonly stop: HTMLButtonElement;
  private layer: Layer = PROPOSED;
  private painting: Painting | null = null;
  private painted = false;

  constructor(private readonly actions: UploadActions) {
    this.sides = choice<Side>("What is held", SIDES, (side) => { this.pick(side); });
    this.file.addEventListener("change", () => {
      const [first] = this.file.files ?? [];
      this.file.value = "";
      if (first !== undefined) actions.chosen(first);
    });
    const press = (words: string, kind: string, act: () => void): HTMLButtonElement =>
      el("button", { class: `button ${kind}`, text: words, attrs: { type: "button" }, on: { click: act } });
    this.go = press("Prepare it", "primary", () => { this.prepare(); });
    this.again = press("Another file", "", () => { this.file.click(); });
    this.stop = press("Cancel", "", () => { this.root.close(); });
    this.drop = el("div", { class: "upload-drop" }, icon("upload"),
      el("p", { text: "Drop a mesh here" }), press("Choose a file", "primary", () => { this.file.click(); }),
      el("p", { class: "fine", text: "STL, OBJ, PLY, GLB, 3MF or a volume mesh. It becomes the object of everybody here." }));
    this.share.addEventListener("input", () => { this.hold({ ...this.layer, share: Number(this.share.value) }); });
    this.soft.addEventListener("input", () => { this.sayHowSoft(); });
    this.shareRow = el("label", { class: "slider" }, el("span", { text: "How much" }), this.share, this.shareWords);
    this.paintRow = el("div", { class: "upload-paint" }, el("span", { class: "fine", text: "Drag over the object. Beside it a drag turns the view." }),
      press("Clear", "", () => { this.painting?.clear(); actions.cleared(); this.refresh(); }));
    const names = el("div", { class: "upload-names" }, ...MATERIALS.map(({ name, young }) =>
      press(name, "small", () => { this.soft.value = `${positionOf(young)}`; this.sayHowSoft(); })));
    this.work = el("div", { class: "upload-work" },
      el("h3", { text: "What was found" }), this.findings,
      el("h3", { text: "What is held" }), this.sides.root, this.shareRow, this.paintRow,
      el("h3", { text: "How soft it is" }), names, this.soft, this.softWords);
    this.wait = el("div", { class: "upload-wait" }, this.phase, this.bar);
    this.root = el("dialog", { class: "dialog upload", attrs: { "aria-labelledby": "upload-title" } },
      el("button", { class: "icon-button dialog-close", attrs: { type: "button", "aria-label": "Close" }, on: { click: () => { this.root.close(); } } }, icon("close")),
      el("h2", { id: "upload-title", text: "An object of your own" }),
      this.drop, el("div", { class: "upload-columns" }, this.host, this.work), this.wait, this.words,
      el("div", { class: "upload-foot" }, this.stop, this.again, this.go), this.file);
    this.root.addEventListener("close", () => { actions.cancel(); });
    this.start();
  }

  open(): void {
    if (this.root.open) return;
    this.start();
    this.root.showModal();
  }

  /** Show a piece of news. */
  news(news: UploadNews): void {
    const shown = news.type === "shown";
    const waits = news.type === "sending" || news.type === "looking" || news.type === "preparing";
    show(this.drop, news.type === "failed" && this.painting === null);
    show(this.wait, waits);
    show(this.words, news.type === "failed" || news.type === "done");
    show(this.go, shown);
    show(this.again, shown || news.type === "failed");
    show(this.stop, news.type !== "done");
    this.work.inert = !shown;
    switch (news.type) {
      case "sending":
        this.progress("Sending the file", news.share);
        break;
      case "looking":
        this.progress("Looking at it", null);
        break;
      case "preparing":
        this.progress(news.phase, news.share > 0 ? news.share : null);
        break;
      case "shown":
        this.examined(news);
        break;
      case "done":
        say(this.words, `It is everybody\u2019s object now. To serve it again: ${news.command}`);
        break;
      case "failed":
        say(this.words, sentence(news.why));
    }
  }

  /** What was painted has changed. */
  refresh(painting: Painting | null = this.painting): void {
    this.painting = painting;
    this.go.disabled = this.painted && (painting === null || painting.empty);
  }

  private start(): void {
    this.painting = null;
    show(this.drop, true);
    for (const part of [this.wait, this.words, this.go, this.again, this.host, this.work]) show(part, false);
    show(this.stop, true);
    this.root.classList.remove("wide");
  }

  private examined(news: Extract<UploadNews, { type: "shown" }>): void {
    const { findings, fix, triangles } = news.examined;
    const lines = findings.map(({ problem, remedy }) => el("li", { text: sentence(`${problem}: ${remedy}`) }));
    this.findings.replaceChildren(el("li", { text: `${triangles.toLocaleString("en")} triangles.` }), ...lines);
    for (const part of [this.host, this.work]) show(part, true);
    this.root.classList.add("wide");
    const layer = layerOf(fix) ?? PROPOSED;
    this.soft.value = `${positionOf(2e4)}`;
    this.sayHowSoft();
    this.sides.set(sideOf(layer));
    this.painted = false;
    this.hold(layer);
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
    this.actions.held(layer);
    this.rows();
  }

  private rows(): void {
    show(this.shareRow, !this.painted);
    show(this.paintRow, this.painted);
    this.refresh();
  }

  private prepare(): void {
    const rule = this.painted ? this.painting?.rule() : layerRule(this.layer);
    if (rule === null) {
      show(this.words, true);
      say(this.words, "That is painted in more pieces than the server takes. Clear it, or take a side.");
    } else if (rule !== undefined && rule !== "") {
      this.actions.prepare(rule, youngAt(Number(this.soft.value)));
    }
  }

  private sayHowSoft(): void {
    const words = sentence(softnessWords(youngAt(Number(this.soft.value))));
    say(this.softWords, words);
    this.soft.setAttribute("aria-valuetext", words);
  }

  private progress(phase: string, share: number | null): void {
    say(this.phase, sentence(phase).replace(/\.$/, "\u2026"));
    if (share === null) this.bar.removeAttribute("value");
    else this.bar.value = share;
  }
}

function sideOf({ axis, sign }: Layer): Side {
  return `${sign < 0 ? "-" : "+"}${"xyz".charAt(axis) as "x" | "y" | "z"}`;
}
