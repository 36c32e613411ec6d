/** A part of the dialog with a heading, in which the server may refuse what was chosen. */

import { el, say, show } from "../dom";
import { sentence } from "../notice";

export class Section {
  readonly root: HTMLElement;
  /** Gets the focus when the choice is refused. */
  protected control: HTMLElement | null = null;
  private readonly refusal: HTMLElement;

  constructor(heading: string, name: string) {
    const id = `upload-${name}`;
    this.refusal = el("p", { class: "upload-refusal", attrs: { role: "alert" } });
    show(this.refusal, false);
    this.root = el("section", { class: "upload-section", attrs: { "aria-labelledby": id } }, el("h3", { id, text: heading }));
  }

  /** The sentence beside the choice; empty takes it away. */
  refuse(why: string): void {
    show(this.refusal, why !== "");
    say(this.refusal, why === "" ? "" : sentence(why));
  }

  /** To where another choice is made. */
  focus(): void {
    this.refusal.scrollIntoView({ block: "nearest" });
    this.control?.focus({ preventScroll: true });
  }

  protected fill(...parts: readonly HTMLElement[]): void {
    this.root.append(...parts, this.refusal);
  }
}
