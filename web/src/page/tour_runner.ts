/** Runs the tour on the page: reads the facts, does the actions, and undoes its changes at the end. */

import type { TouchHandle, TouchState } from "../model/hand";
import type { SceneStore, SceneSnapshot, UserHistory } from "../model/scene";
import { norm, sub, unit, type Vec3 } from "../model/vec";
import { TourCard } from "../tour/card";
import {
  type Action,
  again,
  type Facts,
  goBack,
  goNext,
  pause,
  start,
  tick,
  type TourState,
  type Turn,
} from "../tour/machine";
import { OCEAN, STEPS } from "../tour/steps";
import type { Yardstick } from "../ui/plots/area_plot";
import type { Colouring } from "../view/body/surface";
import { facing, HOME, type Orbit } from "../view/orbit";
import type { OwnHand } from "./own_hand";
import type { Inks } from "../ui/plots/canvas";
import { ForceTrace } from "../ui/plots/force_trace";
import { fixed } from "../ui/words";
import { besides, Partner } from "./partner";
import type { StartTouch } from "./own_hand";
import { SPAN, TourMeasure } from "../tour/measure";
import { guidedDirection } from "./tour_place";

const MOVING: ReadonlySet<Action["kind"]> = new Set(["press", "lift", "hold", "law", "delay"]); // actions that move the own force

/** The parts of the page that the tour may use. */
export interface Hands {
  readonly store: SceneStore;
  readonly view: SceneSnapshot | null;
  readonly own: OwnHand;
  readonly column: {
    readonly area: { measure(by: Yardstick): void };
    /** Bring a part of the page into sight: nothing, the plots, the figure, or the line about the room. */
    reveal(part: "stage" | "plots" | "area" | "room", user: number): void;
  };
  readonly settings: { readonly startTouch: StartTouch };
  /** Websocket of the server. */
  readonly url: string;
  touch(on: boolean): void;
  setColouring(by: Colouring): void;
  look(orbit: Orbit): void;
  /** A partner whom the visitor has brought; null for none. */
  readonly partner: () => TouchHandle | null;
  colour(user: number): string;
  /** The present colours of the page. */
  inks(): Inks;
}

export class TourRunner {
  readonly card: TourCard;
  readonly trace = new ForceTrace();
  private readonly measured = new TourMeasure();
  private readonly partner: Partner;
  /** Wishes that wait until they can be fulfilled. */
  private wantsPartner = false;
  private asked = false; // whether this tour has asked for a partner
  private wantsRehearsal = false;
  private state: TourState | null = null;
  private readonly hands: Hands;
  private touched = false;
  private delay = 0; // s each way; delay of the tour's hands
  private direction: Vec3 | null = null;
  /** Depth of a press that waits until the hand is in the room and engaged; null for none. */
  private pressing: number | null = null;

  constructor(hands: Hands) {
    this.hands = hands;
    this.partner = new Partner(hands.settings.startTouch);
    const now = (): number => performance.now() / 1000;
    const turn = (how: (state: TourState) => Turn): void => {
      if (this.state !== null) this.take(how(this.state));
    };
    this.card = new TourCard({
      next: () => { turn((state) => goNext(STEPS, state, this.facts(), now())); },
      back: () => { turn((state) => goBack(STEPS, state, this.facts(), now())); },
      pause: () => { if (this.state !== null) this.state = pause(this.state, !this.state.paused); },
      close: () => { this.stop(); },
    });
  }

  get running(): boolean {
    return this.state !== null;
  }

  toggle(now: number): void {
    if (this.state !== null) {
      this.stop();
      return;
    }
    this.touched = this.hands.own.handle !== null;
    this.direction = null;
    this.asked = false;
    this.measured.begin();
    this.take(start(STEPS, this.facts(), now));
  }

  /** Begin the step anew, because nobody saw it and its hand has let go. */
  again(): void {
    if (this.state !== null) this.take(again(STEPS, this.state, this.facts(), performance.now() / 1000));
  }

  /** The visitor took over: the tour stops guiding the visitor's hand. */
  yield(): void {
    this.pressing = null;
  }

  update(now: number): void {
    if (this.state === null) return;
    const own = this.hands.own.state;
    if (this.pressing !== null && own?.phase === "joined" && own.doing !== "waiting") {
      this.hands.own.guide(this.place(), this.pressing, now);
      this.pressing = null;
    }
    this.bring();
    // A hand may come later than the wish for the delay.
    for (const hand of this.lent()) hand.setDelay(this.delay);
    const changing = own === null || this.changing(own);
    if (changing) this.measured.disturb(now);
    if (this.wantsRehearsal && !changing && this.measured.rehearse(this.hands.view, own, this.hands.store.info?.simulation_period ?? 1 / 60)) {
      this.wantsRehearsal = false;
    }
    const facts = this.facts();
    this.take(tick(STEPS, this.state, facts, now));
    this.card.update(STEPS, this.state, facts, now);
    this.draw(facts);
  }

  /** Feed every report of the own hand to the measurements. */
  frame(): void {
    const own = this.hands.own.state;
    this.partner.frame();
    if (this.state !== null && own?.phase === "joined") this.measured.take(own);
  }

  /** Bring the partner if nobody else is here. */
  private bring(): void {
    this.partner.update();
    const { info, mesh, roster } = this.hands.store;
    if (!this.wantsPartner || info === null || mesh === null || this.hands.own.state?.phase !== "joined") return;
    this.wantsPartner = false;
    if (this.facts().others === 0) this.partner.come(this.hands.url, [this.hands.own.state.name, ...roster.map(({ name }) => name)], mesh, info, besides(this.place()));
  }

  /** The hands of this page that the tour moves. */
  private lent(): readonly TouchHandle[] {
    return [this.hands.own.handle, this.partner.handle, this.hands.partner()].filter((hand) => hand !== null);
  }

  /** Whether a change by the tour has not taken effect yet. */
  private changing(own: TouchState): boolean {
    return this.pressing !== null || own.law !== own.requested_law || this.lent().some(({ state }) => state?.doing !== "touching") || !this.heardOcean();
  }

  /** Whether the measured loops already contain the delay that the tour gave. */
  private heardOcean(): boolean {
    if (this.delay === 0) return true;
    const hands = this.lent().map(({ state }) => state?.user ?? 0);
    const users = this.hands.view?.users.filter(({ user }) => user > 0 && hands.includes(user)) ?? [];
    return users.every(({ loop_delay }) => loop_delay > 1.8 * OCEAN);
  }

  private draw({ swing, rehearsed }: Facts): void {
    const own = this.hands.own.state;
    this.trace.root.hidden = own?.phase !== "joined" || this.measured.times.length === 0;
    if (own === null || this.trace.root.hidden) return;
    const data = this.trace.root.dataset;
    data["swing"] = swing === null ? "" : swing.size.toFixed(4);
    data["rehearsed"] = rehearsed === null ? "" : rehearsed.size.toFixed(4);
    data["hz"] = rehearsed === null ? "" : rehearsed.hz.toFixed(3);
    const words = [
      `Your force, now: ${fixed(norm(own.force), 2)} N`,
      rehearsed === null ? "" : `The rule for one hand without the lag, rehearsed: swings by ${fixed(rehearsed.size, 2)} N`,
    ] as const;
    this.trace.draw(this.measured, this.measured.rehearsed, words, own.t, SPAN, this.hands.colour(own.user), this.hands.inks());
  }

  private take(turn: Turn): void {
    this.state = turn.state;
    for (const action of turn.actions) this.act(action);
    if (turn.actions.some(({ kind }) => MOVING.has(kind))) this.measured.disturb(performance.now() / 1000);
    if (turn.state.ended) this.stop();
  }

  private stop(): void {
    this.state = null;
    this.pressing = null;
    this.wantsPartner = this.wantsRehearsal = false;
    this.partner.leave();
    this.trace.root.hidden = true;
    this.card.update(STEPS, null, null, 0);
    this.delay = 0;
    for (const hand of this.lent()) hand.setDelay(0);
    this.hands.own.setLaw("predictive");
    this.hands.column.area.measure("coupled");
    this.hands.own.release();
    this.hands.own.hold("natural");
    if (!this.touched) this.hands.own.stop();
  }

  private act(action: Action): void {
    switch (action.kind) {
      case "touch":
        this.hands.touch(true);
        break;
      case "press":
        this.pressing = action.depth;
        break;
      case "lift":
        this.pressing = null;
        this.hands.own.release();
        break;
      case "partner":
        this.wantsPartner = this.asked = true;
        break;
      case "rehearse":
        this.wantsRehearsal = true;
        break;
      case "hold":
        this.hands.own.hold(action.grip);
        break;
      case "law":
        this.hands.own.setLaw(action.law);
        break;
      case "delay":
        this.delay = action.delay;
        break;
      case "measure":
        this.hands.column.area.measure(action.by);
        break;
      case "colour":
        this.hands.setColouring(action.by);
        break;
      case "look":
        this.look(action.at);
        break;
    }
  }

  private look(at: "stage" | "hand" | "plots" | "area" | "room"): void {
    if (at === "hand") this.hands.look(facing(this.place(), 0.75));
    if (at === "stage") this.hands.look(HOME);
    this.hands.column.reveal(at === "hand" ? "stage" : at, this.hands.own.state?.user ?? 0);
  }

  /** Direction of the guided press; chosen once, so that the whole tour is about one place. */
  private place(): Vec3 {
    if (this.direction !== null) return this.direction;
    const body = this.hands.store.info?.body;
    const own = this.hands.own.state?.user ?? 0;
    const users = this.hands.view?.users.filter((user) => user.user !== own && user.c_ii > 0) ?? [];
    const others =
      body === undefined
        ? []
        : users.map((user) => ({ direction: unit(sub(user.foot, body.center)), busy: moved(this.hands.store.history(user.user)) }));
    const chosen = guidedDirection(others, [0.4, -0.9, 0]);
    // A guess made before the scene has come is not kept.
    if (body !== undefined) this.direction = chosen;
    return chosen;
  }

  private facts(): Facts {
    const store = this.hands.store;
    const own: TouchState | null = this.hands.own.state;
    const users = this.hands.view?.users ?? [];
    return {
      others: users.filter((user) => user.user !== own?.user && user.presence > 0.5).length,
      coming: store.info?.can_touch !== false && (!this.asked || (this.wantsPartner && this.hands.own.handle !== null) || this.partner.handle !== null),
      allowFixedGains: store.info?.allow_fixed_gains === true,
      touching: own?.phase === "joined",
      force: norm(own?.force ?? [0, 0, 0]),
      fromOthers: own?.felt_from_others ?? 0,
      lag: this.hands.view?.room.lag ?? 0,
      loopDelay: users.find(({ user }) => user === own?.user)?.loop_delay ?? 0,
      law: own?.law ?? null,
      paper: this.hands.own.law === "paper",
      swing: this.measured.swing(),
      rehearsed: this.measured.rehearsedSwing(),
    };
  }
}

/** Range of a user's force over the stored history [N]. */
function moved(history: UserHistory | null): number {
  let low = Infinity;
  let high = -Infinity;
  for (let i = 0; i < (history?.force.length ?? 0); i++) {
    const f = history?.force.value(i) ?? 0;
    low = Math.min(low, f);
    high = Math.max(high, f);
  }
  return Math.max(0, high - low);
}
