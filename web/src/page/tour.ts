/** The tour's place on the page; the tour's code is loaded when it is first used. */

import { el } from "../ui/dom";
import type { Hands, TourRunner } from "./tour_runner";

export class Tour {
  /** Places of the tour's card and trace. */
  readonly card = el("div", { class: "tour-place" });
  readonly trace = el("div", { class: "trace-place" });
  private runner: TourRunner | null = null;
  private loading = false;

  constructor(private readonly hands: Hands, private readonly failed: () => void) {}

  get running(): boolean {
    return this.runner?.running === true;
  }

  toggle(now: number): void {
    if (this.runner !== null) {
      this.runner.toggle(now);
      return;
    }
    if (this.loading) return;
    this.loading = true;
    import("./tour_runner").then(({ TourRunner }) => {
      this.runner = new TourRunner(this.hands);
      this.card.append(this.runner.card.root);
      this.trace.append(this.runner.trace.root);
      this.runner.toggle(performance.now() / 1000);
    }, () => {
      this.loading = false;
      this.failed();
    });
  }

  /** The visitor took over: the tour stops guiding the visitor's hand. */
  yield(): void {
    this.runner?.yield();
  }

  /** Begin the step anew, because nobody saw it. */
  again(): void {
    this.runner?.again();
  }

  frame(): void {
    this.runner?.frame();
  }

  update(now: number): void {
    this.runner?.update(now);
  }
}
