/**
 * The watch connection: a socket that is opened again when it is lost, acks for drawn frames, and the store behind it.
 *
 * Socket, clock and timers are arguments, so that a test can play the server. `openWatch` passes those of the browser.
 */

import { greenUrl, socketUrl } from "../address";
import type { RestMesh } from "../model/body";
import type { Encoding, LatencyWish, RoomEvent, SceneSnapshot, SceneStore, UserHistory, WatchInfo, WatchPhase, WatchStatus } from "../model/scene";
import type { Order, Restraints } from "../model/orders";
import type { Pass } from "../model/pass";
import type { Recording } from "../model/recording";
import { ABNORMAL, BAD_MESSAGE, FORBIDDEN, NORMAL, UNAUTHENTICATED, WRONG_VERSION } from "../protocol/close_codes";
import { ProtocolError } from "../protocol/frame";
import { SUBPROTOCOL } from "../protocol/layout";
import { encodeControl } from "../protocol/messages";
import { LASTED, wait } from "./backoff";
import { CompanyTalk } from "./company";
import { WatchSession } from "./session";
import { Store } from "./store";
import { Traffic } from "./traffic";

const PATIENCE = 0.25; // s; a frame that is not drawn by then is acknowledged all the same
const FINAL: readonly number[] = [BAD_MESSAGE, UNAUTHENTICATED, FORBIDDEN, WRONG_VERSION]; // refusals that another attempt would not change
const OPEN = 1; // `readyState` of a socket
/** Silence after which a connection is given up for a new one [s]; signs of life come twice a second. */
const GIVEN_UP = 5;
/** `GIVEN_UP` before the first message [s], longer because a slow line carries the page's own files meanwhile. */
const GIVEN_UP_AT_THE_DOOR = 10;
/** `GIVEN_UP` while the resting mesh is being sent [s]: a large message is not received before its end. A server gives up after 30 s. */
const GIVEN_UP_ON_THE_MESH = 35;

/** The services of the browser. */
export interface World {
  /** Time on the page's clock [s]. */
  now(): number;
  /** Calls `action` after a while [s]. */
  later(seconds: number, action: () => void): void;
  /** Random number from 0 to 1. */
  chance(): number;
  /** Whether nobody sees the page, and nothing is drawn. */
  hidden(): boolean;
  socket(url: string, protocol: string): WebSocket;
  fetch(url: string): Promise<ArrayBuffer>;
}

/** Watch the room of a server. */
export class Watch implements SceneStore {
  private readonly store: Store;
  private readonly listeners = new Set<() => void>();
  private socket: WebSocket | null = null;
  private session = new WatchSession();
  private traffic = new Traffic();
  private phase: WatchPhase = "connecting";
  private reason = "";
  private code = 0;
  private retry_at = 0;
  private failures = 0;
  private opened_at = 0;
  /** Time of the newest message of a server [s]; null before the first. */
  private heard_at: number | null = null;
  private drawn = true;
  private asked: { readonly encoding: Encoding; readonly rate: number };
  private closed = false;
  readonly company = new CompanyTalk((message) => { this.say(encodeControl(message)); });

  /** @param address Address of the server, http: or ws:. */
  constructor(
    private readonly address: string,
    encoding: Encoding,
    rate: number,
    private readonly world: World,
    private readonly pass: Pass | null = null,
  ) {
    const fetch = (model: string) => (vertices: readonly number[]) => world.fetch(greenUrl(address, model, vertices));
    this.store = new Store(encoding, rate, fetch, () => world.now(), () => { this.notify(); });
    this.asked = { encoding, rate };
    this.connect();
  }

  get info(): WatchInfo | null {
    return this.store.info;
  }
  get mesh(): RestMesh | null {
    return this.store.mesh;
  }
  get events(): readonly RoomEvent[] {
    return this.store.events;
  }
  get roster(): SceneStore["roster"] {
    return this.store.room.roster;
  }
  get restraints(): Restraints {
    return this.store.room.restraints;
  }
  get onRecord(): boolean {
    return this.store.room.onRecord;
  }
  get putOut(): readonly string[] {
    return this.store.room.putOut;
  }

  get status(): WatchStatus {
    const rates = this.traffic.rates(this.world.now());
    const { cached, missing } = this.store.blocks;
    return {
      phase: this.phase,
      reason: this.reason,
      code: this.code,
      retry_at: this.retry_at,
      silent: this.heard_at === null ? 0 : Math.max(0, this.world.now() - this.heard_at),
      frames: this.traffic.frames,
      bytes: this.traffic.bytes,
      frames_per_second: rates.frames,
      bytes_per_second: rates.bytes,
      playout_delay: this.store.playoutDelay,
      encoding: this.store.inUse,
      blocks: cached,
      blocks_missing: missing,
    };
  }

  at(now: number): SceneSnapshot | null {
    this.acknowledge();
    return this.store.at(now);
  }

  history(user: number): UserHistory | null {
    return this.store.history(user);
  }

  recorded(): Recording | null {
    return this.store.recorded();
  }

  setView(encoding: Encoding, rate: number): void {
    this.say(this.store.setView(encoding, rate));
    this.notify();
  }

  setLatency(user: number, wish: LatencyWish): void {
    this.say(encodeControl({ type: "set_latency", user, ...wish }));
  }

  order(order: Order, user?: number, name?: string): void {
    this.say(encodeControl({ type: "moderate", action: order, user: user ?? null, ...(name === undefined ? {} : { name }) }));
  }

  readonly subscribe = (listener: () => void): (() => void) => {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  };

  close(): void {
    this.closed = true;
    this.socket?.close(NORMAL);
    this.socket = null;
  }

  private connect(): void {
    if (this.closed) return;
    const socket = this.world.socket(socketUrl(this.address), SUBPROTOCOL);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    this.session = new WatchSession();
    this.traffic = new Traffic();
    this.drawn = true;
    this.opened_at = this.world.now();
    this.watchOver(socket);
    socket.onopen = () => {
      const { encoding, rate } = this.store;
      this.asked = { encoding, rate };
      socket.send(WatchSession.greeting(encoding, rate, this.pass?.token));
    };
    socket.onmessage = ({ data }: MessageEvent<string | ArrayBuffer>) => {
      this.hear(socket, typeof data === "string" ? data : new Uint8Array(data));
    };
    socket.onclose = ({ code, reason }) => {
      this.lost(socket, reason || (code === ABNORMAL ? "no server answers" : `closed with ${code}`), code);
    };
  }

  private hear(socket: WebSocket, data: string | Uint8Array): void {
    if (socket !== this.socket) return;
    const now = this.world.now();
    this.heard_at = now;
    try {
      const event = this.session.receive(data);
      this.store.take(event, now);
      this.company.take(event, now);
      if (event.type === "aimed") return; // the view is used by the next picture
      if (event.type === "scene") {
        this.traffic.push(now, data.length);
        if (typeof data !== "string") this.store.keep(event.scene.t_server, data);
        this.expectDrawn();
        return;
      }
      if (event.type === "error") {
        this.lost(socket, event.message, event.code);
        return;
      }
      if (event.type === "watching" && event.session !== undefined) this.pass?.keep(event.session);
      if (event.type === "rest_mesh") this.begin();
      this.notify();
    } catch (error) {
      if (!(error instanceof ProtocolError)) throw error;
      this.lost(socket, `the server broke the protocol: ${error.message}`, 0);
    }
  }

  /** End a silent connection, as a server that stands still or a network that drops everything does not end it. */
  private watchOver(socket: WebSocket): void {
    if (socket !== this.socket) return;
    const patience = this.phase === "watching" ? GIVEN_UP : this.session.awaitsMesh ? GIVEN_UP_ON_THE_MESH : GIVEN_UP_AT_THE_DOOR;
    const left = patience - (this.world.now() - Math.max(this.heard_at ?? 0, this.opened_at));
    if (left <= 0) this.lost(socket, "the server does not answer", ABNORMAL);
    else this.world.later(Math.min(left, GIVEN_UP), () => { this.watchOver(socket); }); // the patience may become shorter
  }

  /** Begin to watch: body and room are known, and scenes follow. */
  private begin(): void {
    [this.phase, this.reason, this.code] = ["watching", "", 0];
    const { encoding, rate } = this.store;
    // The wish may have changed since the greeting.
    if (this.asked.encoding !== encoding || this.asked.rate !== rate) this.setView(encoding, rate);
  }

  /** Acknowledge a frame when it is drawn or should have been drawn, because a hidden page draws none. */
  private expectDrawn(): void {
    this.drawn = false;
    if (this.world.hidden()) {
      this.acknowledge();
      return;
    }
    const { traffic } = this;
    const frame = traffic.frames;
    this.world.later(PATIENCE, () => {
      if (this.traffic === traffic && traffic.frames === frame) this.acknowledge();
    });
  }

  private acknowledge(): void {
    if (this.drawn) return;
    const ack = this.store.ack();
    this.drawn = true;
    if (ack !== null) this.say(ack);
  }

  private say(data: string | Uint8Array<ArrayBuffer>): void {
    if (this.socket?.readyState === OPEN && this.phase === "watching") this.socket.send(data);
  }

  private lost(socket: WebSocket, reason: string, code: number): void {
    if (socket !== this.socket) return;
    this.socket = null;
    socket.close(NORMAL);
    const now = this.world.now();
    this.reason = reason;
    this.code = code;
    // The refused token may be of an expired session or of former keys; the invitation may still be valid.
    const again = code === UNAUTHENTICATED && this.pass?.forget() === true;
    if (FINAL.includes(code) && !again) {
      this.phase = "refused";
    } else {
      this.failures = this.phase === "watching" && now - this.opened_at > LASTED ? 1 : this.failures + 1;
      const seconds = wait(this.failures, this.world.chance());
      this.phase = "waiting";
      this.retry_at = now + seconds;
      this.world.later(seconds, () => {
        this.phase = "connecting";
        this.connect();
        this.notify();
      });
    }
    this.notify();
  }

  private notify(): void {
    for (const listener of this.listeners) listener();
  }
}

/** Watch the room of the server at an address, http: or ws:. */
export function openWatch(address: string, encoding: Encoding = "frames", rate = 30, pass: Pass | null = null): SceneStore {
  return new Watch(address, encoding, rate, {
    now: () => performance.now() / 1000,
    later: (seconds, action) => {
      setTimeout(action, 1000 * seconds);
    },
    chance: () => Math.random(),
    hidden: () => document.hidden,
    socket: (url, protocol) => new WebSocket(url, protocol),
    fetch: async (url) => {
      const response = await fetch(url);
      if (!response.ok) throw new Error(`${url}: ${response.status}`);
      return response.arrayBuffer();
    },
  }, pass);
}
