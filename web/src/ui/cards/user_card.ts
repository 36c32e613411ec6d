/** The card of one user: force, stiffness of its contact, plots, and the injected delay. */

import type { OwnLink, TouchHandle } from "../../model/hand";
import type { Order } from "../../model/orders";
import type { LatencyWish, UserState } from "../../model/scene";
import { forceShare } from "../../model/scale";
import { dot, norm, sub } from "../../model/vec";
import { depthOf, proxyOf } from "../../view/pose";
import { el, say, show, symbol } from "../dom";
import { icon } from "../icons";
import type { AddedNetwork } from "./added_network";
import type { Explanation } from "./explanation";
import { Later } from "./later";
import type { UserOrders } from "./orders";
import type { Inks } from "../plots/canvas";
import type { PlotCursor } from "../plots/cursor";
import type { Lane } from "../plots/lanes";
import type { Charted, StripChart } from "../plots/strip_chart";
import { TraceBuffer } from "../plots/trace_buffer";
import { connectionWords, fixed, LAW_WORDS, milliseconds, softWords, stiffness } from "../words";

/** Columns of a user's trace. */
export const COLUMN = { probe: 0, proxy: 1, force: 2, delay: 3 } as const;
/** Time span of a chart [s]. */
export const SPAN = 6;
const CAPACITY = 1200;

/** One sample: depths of probe and proxy below the resting surface, as in Figs. 7 and 9 [m]; |force| [N]; loop delay [s]. */
export function sample(user: Omit<UserState, "name" | "latency" | "rules">): [number, number, number, number] {
  const below = (point: UserState["probe"]): number => -dot(sub(point, user.foot), user.normal);
  const probe = below(user.probe);
  const touches = user.c_ii > 0 && depthOf(user) > 0;
  return [probe, touches ? below(proxyOf(user)) : Number.NaN, norm(user.force), user.loop_delay];
}

const LANES: readonly Lane[] = [
  {
    name: "position", unit: "mm", factor: 1e3, least: 0.008, zero: true, height: 56,
    lines: [
      { column: COLUMN.proxy, colour: "--proxy", name: "proxy" },
      { column: COLUMN.probe, colour: "--probe", dashed: true, name: "probe" },
    ],
  },
  { name: "force", unit: "N", factor: 1, least: 2, zero: true, height: 38, lines: [{ column: COLUMN.force, colour: "--user" }] },
  { name: "delay of the loop", unit: "ms", factor: 1e3, least: 0.1, zero: true, height: 22, lines: [{ column: COLUMN.delay, colour: "--ink-2" }] },
];

/** Facts about the room on which a card depends. */
export interface CardFacts {
  readonly mayDelay: boolean;
  readonly admin: boolean;
  readonly muted: boolean;
  /** Whether the server is heard now; in a replay, whether it was heard at the shown time. */
  readonly live: boolean;
  /** Connection of the own hand now; null for other hands. */
  readonly link: OwnLink | null;
  /** Whether the user's view may be followed or is followed; "none" for the own hand and for users without a page. */
  readonly view: "open" | "followed" | "none";
}

export class UserCard {
  readonly root: HTMLElement;
  readonly trace = new TraceBuffer(4, CAPACITY);
  private readonly name = el("span", { class: "card-name" });
  private readonly law = el("span", { class: "card-law" });
  private readonly force = el("span", { class: "card-force" });
  private readonly bar = el("span", { class: "bar-fill" });
  private readonly alone = el("dd");
  private readonly coupled = el("dd");
  private readonly gain = el("dd");
  private readonly loop = el("dd");
  private readonly people = el("p", { class: "card-people" });
  private readonly follow: HTMLButtonElement;
  private readonly soft = el("p", {
    class: "card-note",
    title: "This device cannot render the object\u2019s stiffness stably: the hand feels the device\u2019s limit",
  });
  private readonly body: HTMLElement;
  private readonly toggle: HTMLButtonElement;
  private readonly chart: Later<StripChart>;
  private readonly why = new Later<Explanation>(() => import("./explanation").then(({ Explanation: Made }) => new Made()));
  private readonly latency: Later<AddedNetwork>;
  private readonly orders: Later<UserOrders>;

  constructor(user: number, cursor: PlotCursor, setLatency: (wish: LatencyWish) => void, order: (order: Order) => void, follow: () => void) {
    const words = "Probe and proxy below the resting surface, force, and delay of the loop over some seconds";
    this.chart = new Later(() => import("../plots/strip_chart").then(({ StripChart: Made }) => new Made(LANES, words, cursor)));
    this.follow = el("button", { class: "button card-follow", text: "Follow", attrs: { type: "button", "aria-pressed": "false" }, on: { click: follow } });
    this.orders = new Later(() => import("./orders").then(({ UserOrders: Made }) => new Made(order)));
    this.latency = new Later(() => import("./added_network").then(({ AddedNetwork: Made }) => new Made(setLatency)));
    this.body = el(
      "div",
      { class: "card-body", id: `card-${user}` },
      this.chart.root,
      el(
        "dl",
        { class: "facts" },
        el("div", {}, el("dt", { title: "Stiffness of the body here, if nobody else touched it" }, symbol("K", "o"), " alone"), this.alone),
        el("div", {}, el("dt", { title: "The same with everybody's hands on it: what a gain of the paper's laws has to respect" }, symbol("K", "o"), " coupled"), this.coupled),
        el("div", {}, el("dt", { title: "Gain of this user's local model; of the predictive one the object's own stiffness, or its device's limit" }, symbol("K", "h")), this.gain),
        el("div", {}, el("dt", { title: "From a patch to the force made with it, as the server measures it" }, "loop"), this.loop),
      ),
      this.soft,
      this.why.root,
      this.latency.root,
      this.orders.root,
    );
    this.toggle = el(
      "button",
      {
        class: "card-head",
        attrs: { type: "button", "aria-expanded": "true", "aria-controls": `card-${user}` },
        on: { click: () => { this.open(this.body.hidden !== false); } },
      },
      el("span", { class: "swatch", attrs: { "aria-hidden": "true" } }),
      this.name,
      this.law,
      this.force,
      icon("chevron"),
    );
    const bar = el("span", { class: "bar-track", attrs: { "aria-hidden": "true" } }, this.bar);
    this.root = el("section", { class: "card", attrs: { "data-user": `${user}` } }, el("div", { class: "card-line" }, el("h3", { class: "card-title" }, this.toggle), this.follow), bar, this.people, this.body);
  }

  open(open: boolean): void {
    show(this.body, open);
    this.toggle.setAttribute("aria-expanded", `${open}`);
  }

  paint(colour: string): void {
    this.root.style.setProperty("--user", colour);
  }

  /** Remember a moment for the plots. */
  record(user: UserState, t: number): void {
    // The clock of a restarted server begins at another zero.
    if (t < this.trace.last - 1) this.trace.clear();
    this.trace.push(t, sample(user));
  }

  /** Write the numbers; `own` marks the visitor's hand. */
  write(user: UserState | undefined, name: string, own: boolean, { mayDelay, admin, muted, live, link, view }: CardFacts): void {
    show(this.follow, !own && view !== "none");
    say(this.follow, view === "followed" ? "Following" : "Follow");
    this.follow.setAttribute("aria-pressed", `${view === "followed"}`);
    this.follow.setAttribute("aria-label", view === "followed" ? `Following ${name}` : `Follow ${name}`);
    this.follow.title = view === "followed" ? "Back to your own view" : `See what ${name} sees, until you turn the view`;
    // An administrator needs no orders about the own hand.
    const orders = admin && !own;
    this.orders.get(orders)?.write(name, muted, orders);
    say(this.name, own ? `${name} (you)` : name);
    this.root.classList.toggle("own", own);
    const delays = mayDelay && user !== undefined;
    const latency = this.latency.get(delays);
    if (user !== undefined) latency?.write(user.latency, delays);
    show(this.latency.root, delays && latency !== null);
    const soft = user === undefined ? "" : softWords(user);
    say(this.soft, soft);
    show(this.soft, soft !== "");
    if (!live) {
      for (const node of [this.force, this.alone, this.coupled, this.gain, this.loop]) say(node, "\u2013");
      say(this.law, "no word");
      this.law.classList.remove("is-law");
      say(this.people, "");
      this.bar.style.transform = "scaleX(0)";
      return;
    }
    if (user === undefined) {
      say(this.law, "not at the body");
      this.law.classList.remove("is-law");
      say(this.people, "");
      say(this.force, "");
      this.bar.style.transform = "scaleX(0)";
      return;
    }
    const f = norm(user.force);
    say(this.people, connectionWords(user, link));
    say(this.law, muted ? "muted" : LAW_WORDS[user.law][0]);
    this.law.classList.toggle("is-law", !muted);
    say(this.force, `${fixed(f, 2)} N`);
    this.bar.style.transform = `scaleX(${forceShare(f).toFixed(3)})`;
    say(this.alone, user.c_ii > 0 ? stiffness(1 / user.c_ii) : stiffness(0));
    say(this.coupled, stiffness(user.k_o_coupled));
    say(this.gain, stiffness(user.k_h));
    say(this.loop, user.loop_delay > 0 ? milliseconds(user.loop_delay) : "\u2013");
  }

  /** @param scene Data of a replay to draw; null draws the last seconds. */
  draw(now: number, ink: Inks, scene: Charted | null): void {
    if (!this.body.hidden) this.chart.get(true)?.draw(scene ?? { data: this.trace, end: now, span: SPAN, shown: null }, ink);
  }

  /** @param handle The visitor's hand, if this is its card and its force is to be explained; otherwise null. */
  explain(wanted: boolean, user: UserState | undefined, handle: TouchHandle | null): void {
    this.why.get(wanted)?.write(user, handle);
  }
}
