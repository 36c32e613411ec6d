/** Fig. 8 with everybody's gains as moving dots, the figure in words, and the outcomes of rooms like this one. */

import type { RoomLag } from "../../model/body";
import type { UserState } from "../../model/scene";
import { choice, el, say, symbol } from "../dom";
import type { Yardstick } from "../plots/area_plot";
import type { Inks } from "../plots/canvas";
import type { NeighboursPart } from "./neighbours_part";

export class AreaCard {
  readonly root: HTMLElement;
  yardstick: Yardstick = "coupled";
  private readonly canvas = el("canvas", { class: "area", attrs: { role: "img" } });
  private readonly words = el("p", { class: "fine" });
  private readonly colour: (user: number) => string;
  private readonly pick;
  /** Code that draws and describes the figure; loaded when it is first shown, as few visitors look at gains. */
  private figure: typeof import("../plots/area_figure") | null = null;
  private neighbours: NeighboursPart | null = null;
  private fetching = false;

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

  /** Measure the gains by another K_o, as the tour does. */
  measure(yardstick: Yardstick): void {
    this.yardstick = yardstick;
    this.pick.set(yardstick);
  }

  /** @param room Lag of the room; null before it is known. */
  update(users: readonly UserState[], simulationPeriod: number, room: RoomLag | null, ink: Inks): void {
    const missing = this.figure === null || this.neighbours === null;
    if (missing && !this.fetching && this.root.offsetParent !== null) void this.fetch();
    this.neighbours?.update(users, room);
    if (this.figure === null) return;
    this.figure.drawArea(this.canvas, users, simulationPeriod, this.yardstick, this.colour, ink);
    const words = this.figure.areaWords(users, simulationPeriod, room?.lag ?? 0, this.yardstick);
    say(this.words, words);
    this.canvas.setAttribute("aria-label", `Stable gains of the integral law. ${words}`);
  }

  private async fetch(): Promise<void> {
    this.fetching = true;
    try {
      this.figure = await import("../plots/area_figure");
      const { NeighboursPart } = await import("./neighbours_part");
      this.neighbours = new NeighboursPart();
      this.root.append(this.neighbours.root);
    } catch {
      // The network may have failed for a moment: the code is requested again at the next update.
    } finally {
      this.fetching = false;
    }
  }
}
