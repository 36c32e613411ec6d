/** Progress of the work: phase, share and time left. */

import { leftWords, TimeLeft } from "../../upload/time_left";
import { el, say } from "../dom";
import { sentence } from "../notice";

export class Wait {
  readonly root: HTMLElement;
  // Screen readers speak each phase, and not each hundredth of a phase.
  private readonly phase = el("p", { class: "upload-phase", id: "upload-phase", attrs: { role: "status" } });
  private readonly left = el("span", { class: "upload-left" });
  private readonly bar = el("progress", { class: "upload-bar", attrs: { max: "1", "aria-labelledby": "upload-phase" } });
  private time = new TimeLeft();

  constructor() {
    this.root = el("div", { class: "upload-wait" }, el("div", { class: "upload-row" }, this.phase, this.left), this.bar);
  }

  /**
   * @param share Share of the phase that is done, 0 to 1; null while nothing is known.
   * @param now Time [s].
   */
  show(phase: string, share: number | null, now: number): void {
    say(this.phase, sentence(phase).replace(/\.$/, "\u2026"));
    const seconds = this.time.seconds(phase, share ?? 0, now);
    if (share === null) {
      this.bar.removeAttribute("value");
      say(this.left, "");
    } else {
      this.bar.value = share;
      say(this.left, [`${Math.round(100 * share)} %`, leftWords(seconds)].filter((words) => words !== "").join(", "));
    }
  }
}
