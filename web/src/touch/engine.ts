/**
 * The haptic client without I/O: messages, cursor and time in; messages and reports out.
 *
 * The Worker (`worker.ts`) is the shell round it. The loop goes on after a lost connection: the force fades when patches
 * stop coming, and returns when they come again.
 */

import type { HandSettings, TouchSettings, TouchState } from "../model/hand";
import type { FixedGains, LawName } from "../model/laws";
import { dot, norm, type Vec3, ZERO } from "../model/vec";
import { encodeContactSample } from "../protocol/contact_sample";
import { encodeControl, type Welcome } from "../protocol/messages";
import { receive } from "./loop/arrival";
import { CURSOR, type CursorState, dampingLimit, follow, restAt } from "./loop/device";
import type { Period } from "./loop/period";
import { due, HAPTIC_PERIOD } from "./loop/schedule";
import { type LoopSettings, loopSettings, type LoopState, START } from "./loop/state";
import { step } from "./loop/step";
import { type Pacer, reported, sent, WORKER_WAIT } from "./network/pacing";
import { Requests } from "./network/requests";
import { TouchSession } from "./network/session";
import { measured, type Ticked, tickLate, UNTIMED } from "./network/timing";
import { type Connection, reportOf } from "./report";

/** The server refused this client, with a reason. */
export class Refused extends Error {
  override readonly name = "Refused";

  constructor(readonly code: number, reason: string) {
    super(reason);
  }
}

/** The server now has another object than that of the loop. */
export class AnotherObject extends Error {
  override readonly name = "AnotherObject";
}

/** The haptic client of one user. */
export class TouchEngine {
  private cursor: Vec3;
  private presses = true;
  /** Whether the page draws the hand; the hand gives way while it does not. */
  attended = true;
  /** Whether reports explain the force. */
  explains = false;
  private hand: HandSettings;
  private readonly requests: Requests;
  private device: CursorState;
  private loop: LoopState = START;
  private settings: LoopSettings | null = null;
  private newest: Period | null = null;
  private next: number; // when the next period is due
  private session = new TouchSession();
  private pacer: Pacer | null = null;
  private timing = UNTIMED;
  private ticked: Ticked | null = null; // newest tick on this connection
  private late = { tick_late: 0, loop_stall: 0 }; // most since the last report [s]
  private seq = 0;
  private welcome: Welcome | null = null;
  private taken_in = false;
  private object_gone = false;
  private leaving = false;
  private token: string | undefined; // token of the session, when the server has begun one
  private trace: number[] = [];

  constructor(
    private readonly initial: TouchSettings,
    now: number,
  ) {
    this.cursor = initial.target;
    this.hand = initial.hand;
    this.requests = new Requests(initial.name, initial.law, initial.friction);
    this.device = restAt(initial.target);
    this.next = now;
  }

  /** Whether a server has ever welcomed this hand. */
  get joined(): boolean {
    return this.taken_in;
  }

  /** Whether the room is full and this hand waits for a seat. */
  get waits(): boolean {
    return this.session.queued;
  }

  /** To be called when a connection is open; returns its first message. */
  opened(): string {
    this.session = new TouchSession();
    this.seq = 0;
    this.pacer = null;
    [this.timing, this.ticked] = [UNTIMED, null]; // another server may have another clock
    this.requests.greet();
    return TouchSession.greeting(this.asked, CURSOR);
  }

  /** To be called when the connection is lost: nothing more is sent until the welcome on the next one. */
  lost(): void {
    this.pacer = null;
    this.session = new TouchSession();
  }

  /** To be called when there is another object: the former object's force fades at once, and its patches are ignored. */
  leaveObject(): void {
    this.pacer = null;
    this.object_gone = true;
    this.loop = { ...this.loop, arrived: -Infinity };
  }

  /**
   * Begin anew as a hand that has touched nothing yet: it gets a force only after it was free of the new surface.
   *
   * @returns Whether it has begun anew; false while the former force still fades.
   */
  beginAnew(): boolean {
    if (!this.free) return false;
    this.object_gone = false;
    this.loop = START;
    this.requests.fixed = null; // fixed gains were chosen for the former object
    this.settings = this.newest = this.welcome = null;
    return true;
  }

  /**
   * Handle one message from the server; after a ProtocolError, AnotherObject or Refused the connection must be closed.
   *
   * @returns Message to answer with; null for none.
   */
  hear(data: string | Uint8Array, now: number): string | null {
    const event = this.session.receive(data);
    if (event.type === "patch") {
      if (this.settings === null || this.leaving || this.object_gone) return null;
      this.late.tick_late = Math.max(this.late.tick_late, tickLate(this.ticked, event.patch, this.settings.simulation_period));
      this.ticked = event.patch;
      this.loop = receive(this.loop, event.patch, now, this.settings);
      const { seq, t_client, sample_wait } = event.patch;
      if (seq === 0 || this.pacer === null) return null;
      this.pacer = reported(this.pacer, t_client, sample_wait, WORKER_WAIT);
      this.timing = measured(this.timing, event.patch, now);
    } else if (event.type === "place") {
      this.token = event.session ?? this.token;
    } else if (event.type === "named") {
      this.requests.named(event.name, event.reason);
      if (this.welcome !== null) this.welcome = { ...this.welcome, name: event.name };
    } else if (event.type === "called") {
      if (!this.leaving) return encodeControl({ type: "come" });
    } else if (event.type === "welcome") {
      this.begin(event, now);
    } else if (event.type === "error") {
      throw new Refused(event.code, event.message);
    }
    return null;
  }

  point(cursor: Vec3, presses = true): void {
    [this.cursor, this.presses] = [cursor, presses];
  }

  setHand(hand: HandSettings): void {
    this.hand = hand;
  }

  setLaw(law: LawName, fixed: FixedGains | null = null): void {
    this.requests.law = law;
    this.requests.fixed = fixed;
    if (this.settings !== null) this.settings = { ...this.settings, follow: fixed === null };
  }

  setName(name: string): void {
    this.requests.setName(name);
  }

  setFriction(mu: number): void {
    this.requests.mu = mu;
  }

  /**
   * The goodbye message if friction was switched on or off since this connection's hello; null otherwise. The force
   * stays meanwhile, and the server lets the old hand go when the new one comes.
   */
  toJoinAnew(): string | null {
    if (this.pacer === null || !this.requests.needsHello(this.settings?.friction ?? 0)) return null;
    this.pacer = null;
    return encodeControl({ type: "bye" });
  }

  /** Message that requests the user's law; null if the server knows it or there was no welcome yet. */
  lawRequest(): string | null {
    return this.pacer === null ? null : this.requests.lawRequest();
  }

  /** Message that requests the user's name; null if the server knows the hand by that name, or does not know the hand. */
  nameRequest(): string | null {
    return this.pacer === null && !this.waits ? null : this.requests.nameRequest();
  }

  /** Treat the server as silent from now on, so that the force fades before the end. */
  letGo(): void {
    this.leaving = true;
    this.loop = { ...this.loop, arrived: -Infinity };
  }

  /** Whether there is no force on the hand. */
  get free(): boolean {
    return this.newest === null || norm(this.newest.force) === 0;
  }

  /** Last messages of the connection: a sample without force, and the goodbye; none without a welcome. */
  farewell(now: number): readonly (string | Uint8Array<ArrayBuffer>)[] {
    if (this.pacer === null) return [];
    this.pacer = null;
    return [this.sample(now, ZERO, null), encodeControl({ type: "bye" })];
  }

  /** Run the periods that are due; returns the sample to send now, or null. */
  advance(now: number): Uint8Array<ArrayBuffer> | null {
    this.late.loop_stall = Math.max(this.late.loop_stall, now - this.next);
    const [times, next] = due(this.next, now);
    this.next = next;
    for (const t of times) this.period(t);
    if (this.pacer === null || this.pacer.due > now) return null;
    this.pacer = sent(this.pacer, now);
    return this.sample(now, this.newest?.on_body ?? ZERO, this.newest?.anchor ?? null);
  }

  /** Report for the page; begins a new trace. */
  report(now: number, connection: Connection): TouchState {
    const state = reportOf({
      connection, settings: this.asked, welcome: this.welcome, place: this.session.place, name_refused: this.requests.nameRefused,
      loop: this.loop, newest: this.newest, explains: this.explains, cursor: this.cursor, timing: this.timing, leaving: this.leaving,
      late: this.late,
      trace: Float64Array.from(this.trace),
      now,
    });
    [this.trace, this.late] = [[], { tick_late: 0, loop_stall: 0 }];
    return state;
  }

  private period(t: number): void {
    const force = this.newest?.force ?? ZERO;
    this.device = follow(this.device, this.hand, this.cursor, this.presses && this.attended, force, HAPTIC_PERIOD);
    const settings = this.currentSettings();
    if (settings === null) return;
    [this.loop, this.newest] = step(this.loop, this.device.tip, t, settings);
    const { force: given, sight, safety, local } = this.newest;
    this.trace.push(t, Math.hypot(...given), sight?.depth ?? 0, safety.scale * local.felt_from_others);
  }

  /** Begin after the server's welcome. */
  private begin(welcome: Welcome, now: number): void {
    if (this.welcome !== null && this.settings !== null) {
      // The running loop was made for the former welcome.
      const same =
        welcome.simulation_period === this.welcome.simulation_period &&
        JSON.stringify(welcome.body) === JSON.stringify(this.welcome.body);
      if (!same) throw new AnotherObject(welcome.body.name);
    }
    if (welcome.session !== undefined) this.token = welcome.session;
    const { max_force, passivity } = this.initial;
    this.welcome = welcome;
    this.taken_in = true;
    this.settings ??= {
      ...loopSettings(welcome.simulation_period, max_force, CURSOR.stall, CURSOR.max_stiffness),
      max_damping: passivity ? dampingLimit(CURSOR, HAPTIC_PERIOD) : 0,
      friction: this.requests.mu,
      follow: this.requests.fixed === null,
    };
    this.pacer = { period: welcome.simulation_period, due: now };
  }

  /** The settings with the law and the friction that the user wants now. */
  private get asked(): TouchSettings {
    const token = this.token === undefined ? {} : { token: this.token };
    return { ...this.initial, ...token, name: this.requests.name, law: this.requests.law, friction: this.requests.mu };
  }

  /** The settings with the friction of this period; zero until the server sends the compliance that friction needs. */
  private currentSettings(): LoopSettings | null {
    const settings = this.settings;
    if (settings === null) return null;
    const friction = this.loop.patch?.compliance ? this.requests.nextFriction(settings.friction, HAPTIC_PERIOD) : 0;
    if (friction !== settings.friction) this.settings = { ...settings, friction };
    return this.settings;
  }

  private sample(now: number, force: Vec3, anchor: Vec3 | null): Uint8Array<ArrayBuffer> {
    this.seq += 1;
    return encodeContactSample({
      seq: this.seq,
      tick: this.loop.patch?.tick ?? 0,
      t_client: now,
      probe: this.device.tip.position,
      force,
      anchor,
      deflection: dot(this.device.gave.position, this.loop.normal),
      own_model: this.hand,
    });
  }
}
