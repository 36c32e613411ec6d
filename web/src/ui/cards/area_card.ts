/** Fig. 8 with everybody's gains as moving dots, the figure in words, and the outcomes of rooms like this one. */

import type { RoomLag } from "../../model/body";
import type { UserState } from "../../model/scene";
import { choice, el, say, symbol } from "../dom";
import { lazily } from "../lazy";
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
  private readonly fetchFigure = lazily(() => import("../plots/area_figure"), (figure) => { this.figure = figure; });
  private readonly fetchNeighbours = lazily(() => import("./neighbours_part"), ({ NeighboursPart }) => {
    this.neighbours = new NeighboursPart();
    this.root.append(this.neighbours.root);
  });

  constructor(colour: (user: number) => string) {
    this.colour = colour;
    this.pick = choice<Yardstick>(
      "Measure gains by",
      [
        ["alone", "alone", "K_o of each contact as if nobody else touched: the paper's rule"],
        ["coupled", "coupled", "K_o with everybody's hands on the body: what the paper's laws have to respect"],
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
    if ((this.figure === null || this.neighbours === null) && this.root.offsetParent !== null) {
      this.fetchFigure();
      this.fetchNeighbours();
    }
    this.neighbours?.update(users, room);
    if (this.figure === null) return;
    this.figure.drawArea(this.canvas, users, simulationPeriod, this.yardstick, this.colour, ink);
    const words = this.figure.areaWords(users, simulationPeriod, room?.lag ?? 0, this.yardstick);
    say(this.words, words);
    this.canvas.setAttribute("aria-label", `Stable gains of the integral law. ${words}`);
  }
}
