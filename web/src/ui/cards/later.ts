/** The place of a part of the panel whose code is loaded only for visitors who may use it. */

import { el, show } from "../dom";

const AGAIN = 10_000; // ms after which code that could not be loaded is requested again

export class Later<Part extends { readonly root: HTMLElement }> {
  readonly root = el("div");
  private part: Part | null = null;
  private asked = false;

  constructor(private readonly load: () => Promise<Part>) {
    show(this.root, false);
  }

  /** The part when its code is loaded, which the first wish requests; null before. */
  get(wanted: boolean): Part | null {
    if (wanted && !this.asked) {
      this.asked = true;
      void this.load().then((part) => {
        this.part = part;
        this.root.append(part.root);
        show(this.root, true);
      }, () => { setTimeout(() => { this.asked = false; }, AGAIN); });
    }
    return this.part;
  }
}
