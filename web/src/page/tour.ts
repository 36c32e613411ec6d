/** The tour's place on the page: what it consists of comes over the network when it is asked for. */

import { el } from "../ui/dom";
import type { Hands, TourRunner } from "./tour_runner";

export class Tour {
  /** Where its card and its trace stand. */
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

  /** The visitor took over: the guide's hand lets go of theirs. */
  yield(): void {
    this.runner?.yield();
  }

  /** The step from its beginning: nobody saw it. */
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
