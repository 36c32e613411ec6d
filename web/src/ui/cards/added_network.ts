/** The network that is added between a user and the server: one of a list, with another delay and jitter. */

import type { Latency, LatencyWish } from "../../model/scene";
import { el, say, show } from "../dom";

/** Names of networks, as the server knows them (`cohaptic.simulated.networks`). */
const NETWORKS = ["", "lan", "wifi", "wifi-busy", "4g", "5g", "satellite", "transatlantic"];

export class AddedNetwork {
  readonly root: HTMLElement;
  private readonly network: HTMLSelectElement;
  /** A network with other words than a name. */
  private readonly other = el("option");
  private chosen = 0; // timer that runs while the server may not have heard what was chosen
  private readonly delay: Slider;
  private readonly jitter: Slider;

  constructor(wish: (wish: LatencyWish) => void) {
    const options = NETWORKS.map((value) => el("option", { text: value || "none", attrs: { value } }));
    const choose = (): void => {
      clearTimeout(this.chosen);
      this.chosen = window.setTimeout(() => { this.chosen = 0; }, ECHO);
      wish({ network: this.network.value });
    };
    this.network = el("select", { attrs: { "aria-label": "added network" }, on: { change: choose } }, ...options);
    const send = (): void => { wish({ network: this.network.value, delay: 1e-3 * this.delay.value, jitter: 1e-3 * this.jitter.value }); };
    this.delay = slider("added delay", { max: 500, step: 10, unit: "ms" }, send);
    this.jitter = slider("added jitter", { max: 200, step: 5, unit: "ms" }, send);
    const list = el("label", { class: "slider" }, el("span", { class: "slider-name", text: "added network" }), this.network);
    this.root = el("div", { class: "latency" }, list, this.delay.root, this.jitter.root);
  }

  /** Show what is added now; `there` is whether the user is. */
  write({ network, delay, jitter }: Latency, there: boolean): void {
    show(this.root, there);
    if (this.chosen === 0 && network !== this.network.value) {
      if (NETWORKS.includes(network)) this.other.remove();
      else {
        this.other.value = this.other.textContent = network;
        this.network.append(this.other);
      }
      this.network.value = network;
    }
    this.delay.set(1e3 * delay);
    this.jitter.set(1e3 * jitter);
  }
}

/** A slider with its name and its value in words. */
interface Slider {
  readonly root: HTMLElement;
  /** Value as it was set, even between two steps of the slider. */
  readonly value: number;
  /** Set the value, but not while a finger drags the slider or soon after a key: the value may be an echo of an earlier step. */
  set(value: number): void;
}

const ECHO = 1000; // ms; longer than an echo takes

function slider(
  label: string,
  range: { readonly max: number; readonly step: number; readonly unit: string },
  moved: () => void,
): Slider {
  const input = el("input", { attrs: { type: "range", value: "0", min: "0", max: `${range.max}`, step: `${range.step}`, "aria-label": label } });
  const value = el("output", { class: "slider-value" });
  let chosen = 0;
  const words = (): void => {
    const said = `${Math.round(chosen)} ${range.unit}`;
    say(value, said);
    input.setAttribute("aria-valuetext", said);
    input.style.setProperty("--share", `${(100 * Number(input.value)) / range.max}%`);
  };
  let timer = 0; // runs while echoes may come
  input.addEventListener("input", () => {
    clearTimeout(timer);
    timer = window.setTimeout(() => { timer = 0; }, ECHO);
    chosen = Number(input.value);
    words();
    moved();
  });
  words();
  return {
    root: el("label", { class: "slider" }, el("span", { class: "slider-name", text: label }), input, value),
    get value() { return chosen; },
    set: (next) => {
      if (timer !== 0 || (document.activeElement === input && input.matches(":active"))) return;
      chosen = next;
      input.value = `${next}`;
      words();
    },
  };
}
