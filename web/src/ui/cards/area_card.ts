/** Fig. 8 with everybody's gains as moving dots, and the same in words. */

import type { UserState } from "../../model/scene";
import { choice, el, say, symbol } from "../dom";
import { drawArea, periods, verdict, type Yardstick } from "../plots/area_plot";
import type { Inks } from "../plots/canvas";

export class AreaCard {
  readonly root: HTMLElement;
  yardstick: Yardstick = "coupled";
  private readonly canvas = el("canvas", { class: "area", attrs: { role: "img" } });
  private readonly words = el("p", { class: "fine" });
  private readonly colour: (user: number) => string;
  private readonly pick;

  constructor(colour: (user: number) => string) {
    this.colour = colour;
    this.pick = choice<Yardstick>(
      "Measure gains by",
      [
        ["alone", "alone", "K_o of each contact as if nobody else touched: the paper's rule"],
        ["coupled", "coupled", "K_o with everybody's hands on the body: what the paper's laws have to respect for N users"],
      ],
      (value) => { this.yardstick = value; },
    );
    this.pick.set(this.yardstick);
    this.root = el(
      "section",
      { class: "card area-card", attrs: { "aria-labelledby": "area-title" } },
      el("div", { class: "area-head" }, el("h3", { class: "area-title", id: "area-title", text: "Stable gains" }), this.pick.root),
      this.canvas,
      el("p", { class: "axis-x" }, symbol("K", "h"), " / ", symbol("K", "o"), " \u2192,  ", symbol("I N T"), " / ", symbol("K", "o"), " \u2191"),
      this.words,
    );
  }

  /** Measure by another K_o, as the tour does. */
  measure(yardstick: Yardstick): void {
    this.yardstick = yardstick;
    this.pick.set(yardstick);
  }

  /** @param lag Of the room [s]. */
  update(users: readonly UserState[], simulationPeriod: number, lag: number, ink: Inks): void {
    drawArea(this.canvas, users, simulationPeriod, this.yardstick, this.colour, ink);
    const words = areaWords(users, simulationPeriod, lag, this.yardstick);
    say(this.words, words);
    this.canvas.setAttribute("aria-label", `Stable gains of the integral law. ${words}`);
  }
}

/** The figure in words. */
export function areaWords(users: readonly UserState[], simulationPeriod: number, lag: number, yardstick: Yardstick): string {
  const named = (place: string): string[] =>
    users.filter((user) => verdict(user, simulationPeriod, yardstick) === place).map((user) => user.name || `user ${user.user}`);
  const outside = named("outside");
  const own = named("own");
  const longest = Math.max(0, ...users.map((user) => periods(user.loop_delay, simulationPeriod)));
  const parts = [
    longest > 0
      ? `Outer line: no delay. Filled: the longest loop here, ${longest} ${longest === 1 ? "period" : "periods"} late.`
      : "The triangle of eq. (15), without delay.",
  ];
  if (outside.length > 0) {
    const so = lag > 0 ? "and kept from swinging by the room\u2019s lag" : "so bound to swing";
    parts.push(`Outside, ${so}: ${outside.join(", ")}.`);
  }
  if (own.length > 0) parts.push("A ring is the predictive law: no delay asks it for a smaller gain.");
  return parts.join(" ");
}
