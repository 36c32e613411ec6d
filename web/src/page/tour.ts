/** The tour's place on the page; the tour's code is loaded when it is first used. */

import { el } from "../ui/dom";
import { lazily } from "../ui/lazy";
import type { Hands, TourRunner } from "./tour_runner";

export class Tour {
  /** Places of the tour's card and trace. */
  readonly card = el("div", { class: "tour-place" });
  readonly trace = el("div", { class: "trace-place" });
  private runner: TourRunner | null = null;
  private readonly load: () => void;

  /** @param failed Called if the tour's code does not come. */
  constructor(hands: Hands, failed: () => void) {
    this.load = lazily(() => import("./tour_runner"), ({ TourRunner }) => {
      this.runner = new TourRunner(hands);
      this.card.append(this.runner.card.root);
      this.trace.append(this.runner.trace.root);
      this.runner.toggle(performance.now() / 1000);
    }, failed);
  }

  get running(): boolean {
    return this.runner?.running === true;
  }

  toggle(now: number): void {
    this.runner?.toggle(now);
    this.load();
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
