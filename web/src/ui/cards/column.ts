/** The column beside the stage: a card for each user, and Fig. 8. */

import type { TouchHandle, TouchState } from "../../model/hand";
import { type Encoding, isLive, type SceneStore, type SceneSnapshot } from "../../model/scene";
import { AreaCard } from "./area_card";
import { type Choice, choice, el, say, show } from "../dom";
import { type Inks, inks } from "../plots/canvas";
import type { RoomOrders } from "./orders";
import { Later } from "./later";
import { Level } from "./level";
import type { PlotCursor } from "../plots/cursor";
import type { Charted } from "../plots/strip_chart";
import { Sheet } from "./sheet";
import { UserCard } from "./user_card";
import { bytesPerSecond, lagReasons, lagWords, milliseconds } from "../words";

const OPEN_AT_FIRST = 3;
const RATE = 30; // frames per second that the page requests; it interpolates between them

/** Data of a replay that the column shows in place of the present. */
export interface Lens {
  /** Whether the server was heard at the shown time. */
  readonly known: boolean;
  /** Age of the shown time, in words. */
  readonly when: string;
  /** Returns the plots of a hand round the shown time. */
  readonly charted: (user: number) => Charted;
}

/** The parts of the page that the column needs. */
export interface ColumnPage {
  readonly store: SceneStore;
  /** The shown scene, present or past; null before it has come. */
  readonly shown: SceneSnapshot | null;
  readonly own: { readonly state: TouchState | null; readonly handle: TouchHandle | null };
  readonly replay: { readonly lens: Lens | null };
  readonly company: { readonly bar: HTMLElement; readonly following: number | null; toggle(user: number): void };
  colour(user: number): string;
  toggle(panel: string): void;
}

export class Column {
  readonly root: HTMLElement;
  /** The last line of the column, before which more cards may stand. */
  readonly end: HTMLElement;
  readonly area: AreaCard;
  /** Place for the offers while nobody else is here. */
  readonly offers = el("div");
  private readonly cards = new Map<number, UserCard>();
  private readonly list = el("div", { class: "cards" });
  private readonly count = el("span", { class: "count" });
  private readonly empty = el("p", {
    class: "empty",
    text: "Nobody is here yet. Touch the object yourself.",
  });
  private readonly answers = el("summary");
  private readonly reasons = el("p", { class: "fine" });
  private readonly time = el("details", { class: "room-time" }, this.answers, this.reasons);
  private readonly stream = el("p", { class: "stream-words" });
  private readonly encoding: Choice<Encoding>;
  /** Level of detail: people only, or also what an engineer asks for. */
  readonly level = new Level(() => this.root.parentElement);
  private readonly sheet = new Sheet(() => this.root.parentElement);
  private readonly latencyNote = el("p", {
    class: "fine latency-note",
    text: "This server does not let pages add delay; start it with --allow-latency to get sliders here.",
  });
  private readonly roomOrders: Later<RoomOrders>;
  private readonly frozen = el("p", { class: "fine room-orders", text: "The object is frozen: it takes nobody\u2019s force." });
  private readonly cursor: PlotCursor = { before: null };
  private readonly when = el("span", { class: "count panel-when" });
  private ink: Inks | null = null;

  constructor(private readonly page: ColumnPage) {
    this.roomOrders = new Later(() => import("./orders").then(({ RoomOrders: Made }) => new Made((...order) => { page.store.order(...order); })));
    this.encoding = choice<Encoding>(
      "How the surface comes",
      [
        ["forces", "forces", "Only contact forces come; the page computes the exact surface from them"],
        ["frames", "frames", "The whole surface comes, quantised and compressed"],
      ],
      (encoding) => { page.store.setView(encoding, RATE); },
    );
    this.encoding.set("forces");
    this.end = el("div", { class: "stream" }, this.encoding.root, this.stream);
    this.area = new AreaCard((user) => page.colour(user));
    this.root = el(
      "aside",
      { class: "panel", id: "panel", attrs: { "aria-label": "Hands and stability" } },
      this.sheet.root,
      el("div", { class: "panel-title" }, el("h2", { class: "panel-name", id: "hands" }, "Hands ", this.count, " ", this.when),
        el("button", { class: "button share-button", text: "Invite", title: "The address of this room, and its QR code", attrs: { type: "button" }, on: { click: () => { page.toggle("share"); } } }), this.level.root),
      page.company.bar,
      this.frozen, this.roomOrders.root,
      this.time,
      this.empty,
      this.offers,
      this.list,
      this.latencyNote,
      this.area.root,
      this.end,
    );
  }

  /** Draw with the colours of the new scheme, light or dark. */
  repaint(): void {
    this.ink = null;
    for (const [user, card] of this.cards) card.paint(this.page.colour(user));
  }

  /** Bring a part into sight; on the stage alone nothing is scrolled. */
  reveal(part: "stage" | "plots" | "area" | "room", user: number): void {
    const parts = { stage: undefined, area: this.area.root, plots: this.cards.get(user)?.root, room: this.time };
    const target = parts[part];
    this.cards.get(user)?.open(true);
    for (const card of [this.time, this.area.root, ...[...this.cards.values()].map((c) => c.root)]) {
      card.classList.toggle("shown", card === target);
    }
    if (target !== undefined) this.level.show(true);
    target?.scrollIntoView({ block: part === "plots" || part === "room" ? "start" : "nearest", behavior: "auto" });
  }

  /** Remember this moment for the plots; cheap, and called for every frame. */
  record(view: SceneSnapshot): void {
    for (const user of view.users) this.card(user.user).record(user, view.t_server);
  }

  /** Write and draw all visible parts; called some times a second. */
  update(): void {
    const { store, shown: view, own: { state, handle }, replay: { lens }, company: { following } } = this.page;
    const own = state?.user ?? 0;
    const ink = (this.ink ??= inks(this.root));
    const present = new Set([...store.roster.map((r) => r.user), ...(view?.users ?? []).map((u) => u.user)]);
    for (const [user, card] of this.cards) {
      if (present.has(user)) continue;
      card.root.remove();
      this.cards.delete(user);
    }
    for (const user of [...present].sort((a, b) => a - b)) {
      const state = view?.users.find((u) => u.user === user);
      const name = state?.name ?? store.roster.find((r) => r.user === user)?.name ?? "";
      this.card(user).write(state, name === "" ? `user ${user}` : name, user === own, {
        // Orders apply to the present and not to a replay.
        mayDelay: lens === null && store.info?.allow_latency === true,
        admin: lens === null && store.info?.room_admin === true,
        muted: lens === null && store.restraints.muted.includes(user),
        link: lens === null && user === own ? (handle?.link ?? null) : null,
        live: lens === null ? isLive(store.status) : lens.known,
        view: lens !== null ? "none" : following === user ? "followed" : store.company.state?.open.includes(user) === true ? "open" : "none",
      });
    }
    const orders = store.info?.room_admin === true || store.info?.can_record === true;
    show(this.frozen, store.restraints.frozen);
    this.roomOrders.get(orders)?.write(store);
    say(this.when, lens?.when ?? "");
    say(this.count, present.size === 0 ? "" : `${present.size}`);
    this.tellTime(view);
    show(this.empty, present.size === 0 && store.status.phase === "watching");
    show(this.latencyNote, store.info !== null && !store.info.allow_latency && present.size > 0);
    if (view !== null) {
      if (this.level.engineer) for (const [user, card] of this.cards) card.draw(view.t_server, this.userInk(ink, user), lens?.charted(user) ?? null);
    }
    // A replay shows the forces of another time.
    const explained = this.level.engineer && lens === null ? handle : null;
    for (const [user, card] of this.cards) {
      card.explain(this.level.engineer, view?.users.find((one) => one.user === user), user === own ? explained : null);
    }
    this.area.update(view?.users ?? [], store.info?.simulation_period ?? 1 / 60, view?.room ?? null, ink);
    // A body without Green's functions is always sent as frames, whatever the page requests.
    this.encoding.enable("forces", store.info?.model !== null);
    say(this.stream, streamWords(store));
  }

  /** Write how fast the object responds, which the numbers of a hand do not show. */
  private tellTime(view: SceneSnapshot | null): void {
    const words = view === null ? "" : lagWords(view.room, view.users.filter((user) => user.c_ii > 0).length);
    show(this.time, words !== "");
    if (view === null || words === "") return;
    say(this.answers, words);
    say(this.reasons, lagReasons(view.room));
  }

  private userInk(ink: Inks, user: number): Inks {
    return { ...ink, get: (name) => (name === "--user" ? this.page.colour(user) : ink.get(name)) };
  }

  private card(user: number): UserCard {
    let card = this.cards.get(user);
    if (card === undefined) {
      card = new UserCard(user, this.cursor, (wish) => {
        this.page.store.setLatency(user, wish);
      }, (order) => { this.page.store.order(order, user); }, () => { this.page.company.toggle(user); });
      card.paint(this.page.colour(user));
      card.open(this.cards.size < OPEN_AT_FIRST);
      this.cards.set(user, card);
      // Cards are in the order of user numbers, not in that of arrival.
      const after = [...this.cards.keys()].filter((u) => u > user).sort((a, b) => a - b)[0];
      this.list.insertBefore(card.root, after === undefined ? null : (this.cards.get(after)?.root ?? null));
    }
    return card;
  }
}

/** Encoding and rate of the stream, in one line. */
function streamWords(store: SceneStore): string {
  const s = store.status;
  if (s.phase !== "watching") return "";
  const fetching = s.blocks_missing > 0 ? [`fetching ${s.blocks_missing} blocks`] : [];
  const parts = [bytesPerSecond(s.bytes_per_second), `${Math.round(s.frames_per_second)} frames/s`, ...fetching];
  return [...parts, `${milliseconds(s.playout_delay)} behind`].join(" \u00b7 ");
}
