/** A part of the dialog with a heading, in which the server may refuse what was chosen. */

import { el, say, show } from "../dom";
import { sentence } from "../notice";

export class Section {
  readonly root: HTMLElement;
  /** Control that gets the focus when the choice is refused. */
  protected control: HTMLElement | null = null;
  private readonly refusal: HTMLElement;

  constructor(heading: string, name: string) {
    const id = `upload-${name}`;
    this.refusal = el("p", { class: "upload-refusal", attrs: { role: "alert" } });
    show(this.refusal, false);
    this.root = el("section", { class: "upload-section", attrs: { "aria-labelledby": id } }, el("h3", { id, text: heading }));
  }

  /** Show a sentence beside the choice; empty removes it. */
  refuse(why: string): void {
    show(this.refusal, why !== "");
    say(this.refusal, why === "" ? "" : sentence(why));
  }

  /** Move the focus to the control of this choice. */
  focus(): void {
    this.refusal.scrollIntoView({ block: "nearest" });
    this.control?.focus({ preventScroll: true });
  }

  protected fill(...parts: readonly HTMLElement[]): void {
    this.root.append(...parts, this.refusal);
  }
}
