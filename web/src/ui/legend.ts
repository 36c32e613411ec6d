/** The legend of the surface colours, and the switch between displacement and stiffness. */

import { colourAt, DISPLACEMENT, type Scheme, STIFFNESS } from "../model/colours";
import type { Colouring, Legend } from "../view/body/surface";
import { choice, el, say } from "./dom";
import { fixed } from "./words";

export class LegendBox {
  readonly root: HTMLElement;
  private readonly strip = el("canvas", { class: "legend-strip", attrs: { width: "160", height: "1", "aria-hidden": "true" } });
  private readonly low = el("span");
  private readonly middle = el("span");
  private readonly high = el("span");
  private readonly pick;
  private painted = "";

  constructor(picked: (colouring: Colouring) => void) {
    this.pick = choice<Colouring>(
      "Colour of the surface",
      [
        ["displacement", "Displacement", "How far the surface went in (blue) or out (amber)"],
        ["stiffness", "Stiffness", "K_o where the surface has been touched"],
      ],
      picked,
    );
    this.pick.set("displacement");
    this.root = el(
      "div",
      { class: "legend" },
      this.pick.root,
      this.strip,
      el("div", { class: "legend-scale" }, this.low, this.middle, this.high),
    );
  }

  update(legend: Legend, scheme: Scheme): void {
    const [low, middle, high] = legendWords(legend);
    say(this.low, low);
    say(this.middle, middle);
    say(this.high, high);
    const look = `${legend.colouring} ${scheme}`;
    if (look === this.painted) return;
    this.painted = look;
    this.pick.set(legend.colouring);
    const map = legend.colouring === "displacement" ? DISPLACEMENT[scheme] : STIFFNESS;
    const c = this.strip.getContext("2d");
    if (c === null) return;
    for (let x = 0; x < 160; x++) {
      const colour = colourAt(map, x / 159).map((v) => Math.round(255 * v));
      c.fillStyle = `rgb(${colour.join(",")})`;
      c.fillRect(x, 0, 1, 1);
    }
  }
}

/** Words of the legend under the left end, the middle and the right end. */
export function legendWords(legend: Legend): [string, string, string] {
  const { low, high } = legend;
  if (legend.colouring === "displacement") {
    const mm = fixed(1e3 * (high ?? 0), 0);
    return [`${mm} mm in`, "at rest", `${mm} mm out`];
  }
  if (low === null || high === null) return ["", "touch it to find out", ""];
  // A single value makes no scale.
  if (fixed(low, 0) === fixed(high, 0)) return ["", `${fixed(low, 0)} N/m where it was touched`, ""];
  return [`${fixed(low, 0)} N/m`, "", `${fixed(high, 0)} N/m`];
}
