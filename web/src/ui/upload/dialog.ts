/** The dialog in which a visitor brings an object: choose a file, look at it, say what it is like, wait. */

import type { UploadNews, Wish } from "../../upload/client";
import { boxOf, type Layer, type Painting } from "../../upload/held";
import { el, say, show } from "../dom";
import { icon } from "../icons";
import { sentence } from "../notice";
import { HeldChoice } from "./held_choice";
import { SizeChoice } from "./size_choice";
import { SoftChoice } from "./soft_choice";
import { Wait } from "./wait";

const LABEL = "The object before it is prepared. Drag it or press the arrow keys to turn it, plus and minus to zoom.";

/** The actions of the dialog. */
export interface UploadActions {
  readonly chosen: (file: File) => void;
  readonly prepare: (wish: Wish) => void;
  readonly cancel: () => void;
  /** Bring the visitor's hand to the new object. */
  readonly touch: () => void;
  /** Called when another part is to be held. */
  readonly held: (layer: Layer | null) => void;
  readonly cleared: () => void;
  /** Called when the object is to be `larger` times as large as shown; returns words on a familiar thing of that size. */
  readonly sized: (larger: number) => string;
}

export class UploadDialog {
  readonly root: HTMLDialogElement;
  /** Holds the picture. */
  readonly host = el("div", { class: "upload-host", attrs: { tabindex: "0", role: "img", "aria-label": LABEL } });
  private readonly beside = el("p", { class: "upload-beside fine" });
  private readonly file = el("input", { class: "for-ears", attrs: { type: "file", tabindex: "-1", "aria-label": "Mesh file" } });
  private readonly drop: HTMLElement;
  private readonly work: HTMLElement;
  private readonly wait = new Wait();
  private readonly words = el("p", { class: "upload-words", attrs: { role: "alert", tabindex: "-1" } });
  private readonly findings = el("ul", { class: "upload-findings", attrs: { tabindex: "0", "aria-label": "What was found" } });
  private readonly held: HeldChoice;
  private readonly size: SizeChoice;
  private readonly soft = new SoftChoice();
  private readonly go: HTMLButtonElement;
  private readonly again: HTMLButtonElement;
  private readonly stop: HTMLButtonElement;
  private readonly done: HTMLButtonElement;
  /** Metres in one unit of the file, in the picture. */
  private shown = 1;

  constructor(private readonly actions: UploadActions) {
    this.held = new HeldChoice({
      held: (layer) => { actions.held(layer); this.check(); },
      cleared: () => { actions.cleared(); this.check(); },
    });
    this.size = new SizeChoice((scale) => { this.compare(scale / this.shown); });
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
    this.done = press("Touch it", "primary", () => { this.root.close(); actions.touch(); });
    this.drop = el("div", { class: "upload-drop" }, icon("upload"),
      el("p", { text: "Drop a mesh or a scan here" }), press("Choose a file", "primary", () => { this.file.click(); }),
      el("p", { class: "fine", text: "STL, OBJ, PLY, GLB, 3MF, a volume mesh, or the label map of a scan. It becomes the object of everybody here." }));
    this.work = el("div", { class: "upload-work" },
      el("h3", { text: "What was found" }), this.findings, this.size.root, this.held.root, this.soft.root);
    this.root = el("dialog", { class: "dialog upload", attrs: { "aria-labelledby": "upload-title" } },
      el("button", { class: "icon-button dialog-close", attrs: { type: "button", "aria-label": "Close" }, on: { click: () => { this.root.close(); } } }, icon("close")),
      el("h2", { id: "upload-title", text: "An object of your own" }),
      this.drop, el("div", { class: "upload-columns" }, el("div", { class: "upload-picture" }, this.host, this.beside), this.work),
      this.wait.root, this.words, el("div", { class: "upload-foot" }, this.stop, this.again, this.go, this.done), this.file);
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
    const chooses = news.type === "shown" || news.type === "refused";
    const waits = news.type === "sending" || news.type === "looking" || news.type === "preparing";
    show(this.drop, news.type === "failed" && this.host.hidden !== false);
    show(this.wait.root, waits);
    show(this.words, news.type === "failed" || news.type === "done" || (news.type === "refused" && news.about === "file"));
    show(this.go, chooses);
    show(this.again, chooses || news.type === "failed");
    show(this.stop, news.type !== "done");
    show(this.done, news.type === "done");
    this.work.inert = !chooses;
    const now = performance.now() / 1000;
    switch (news.type) {
      case "sending":
        this.wait.show("Sending the file", news.share, now);
        break;
      case "looking":
        this.wait.show("Looking at it", null, now);
        break;
      case "preparing":
        this.wait.show(news.phase, news.share > 0 ? news.share : null, now);
        break;
      case "shown":
        this.examined(news);
        break;
      case "refused":
        this.refused(news);
        break;
      case "done":
        say(this.words, `It is everybody\u2019s object now. To serve it again: ${news.command}`);
        this.done.focus();
        break;
      case "failed":
        say(this.words, sentence(news.why));
    }
    this.keepFocus();
  }

  /** To be called when the painted part has changed. */
  refresh(painting: Painting | null): void {
    this.held.paint(painting);
    this.check();
  }

  private start(): void {
    show(this.drop, true);
    for (const part of [this.wait.root, this.words, this.go, this.again, this.done, this.host, this.beside, this.work]) show(part, false);
    show(this.stop, true);
    this.root.classList.remove("wide");
  }

  private examined(news: Extract<UploadNews, { type: "shown" }>): void {
    const { findings, fix, scale, triangles, middle } = news.examined;
    const lines = findings.map(({ problem, remedy }) => el("li", { text: sentence(`${problem}: ${remedy}`) }));
    this.findings.replaceChildren(el("li", { text: `${triangles.toLocaleString("en")} triangles.` }), ...lines);
    for (const part of [this.host, this.work]) show(part, true);
    this.root.classList.add("wide");
    const { low, high } = boxOf(news.mesh.vertices);
    this.shown = scale;
    this.size.propose(scale, [high[0] - low[0], high[1] - low[1], high[2] - low[2]]);
    this.soft.propose();
    this.held.propose(fix, middle);
  }

  private refused({ about, why, tries }: Extract<UploadNews, { type: "refused" }>): void {
    const left = tries === 1 ? " (one more try)" : "";
    if (about === "file") {
      say(this.words, sentence(`${why}${left}`));
      this.words.focus();
      return;
    }
    const section = about === "held" ? this.held : this.size;
    section.refuse(`${why}${left}`);
    section.focus();
  }

  private compare(larger: number): void {
    const words = this.actions.sized(larger);
    show(this.beside, words !== "");
    say(this.beside, `Beside it: ${words}`);
    this.check();
  }

  /** Check whether the chosen object can be prepared. */
  private check(): void {
    this.go.disabled = !(this.size.possible && this.held.possible);
  }

  private prepare(): void {
    const rule = this.held.rule(this.size.scale / this.shown);
    if (rule === null) {
      this.held.refuse("That is painted in more pieces than the server takes. Clear it, or take a side.");
      this.held.focus();
    } else if (rule !== "") {
      this.actions.prepare({ rule, scale: this.size.scale, young: this.soft.young });
    }
  }

  /** Move the focus to the next possible action if the element with the focus is gone. */
  private keepFocus(): void {
    const focused = document.activeElement;
    if (!this.root.open || (focused instanceof HTMLElement && this.root.contains(focused) && focused.checkVisibility() && focused.closest("[inert]") === null)) return;
    const next = [this.go, this.done, this.again, this.stop].find((button) => !button.hidden && !button.disabled);
    (next ?? this.stop).focus({ preventScroll: true });
  }
}
