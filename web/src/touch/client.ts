/**
 * One hand at one server: engine, socket and timers. The client decides when to reconnect.
 *
 * Socket, clock and timers are arguments, so that a test can play the server.
 */

import type { TouchSettings, TouchState } from "../model/hand";
import { ABNORMAL, NAME_TAKEN, NORMAL, OBJECT_CHANGED, SERVER_STOPS } from "../protocol/close_codes";
import { ProtocolError } from "../protocol/frame";
import { SUBPROTOCOL } from "../protocol/layout";
import { AnotherObject, Refused, TouchEngine } from "./engine";
import { FarSocket } from "./far_socket";
import type { Message } from "./network/delay_line";
import type { Connection } from "./report";
import type { FromWorker, ToWorker } from "./worker_messages";

const WAKE = 0.002; // s between two wakes; browsers make it 4 ms
const REPORT = 1 / 60; // s
const RETRY = 0.5; // s between attempts to reach a server
const LONGEST_FADE = 1.1; // s; a force of ten newtons fades within one second
const GIVEN_UP = 5; // s without a message, after which a new connection is tried; patches come at each tick
const GIVEN_UP_OUTSIDE = 10; // s; the same before the welcome: a waiting client hears its place every two seconds, on a slow line later
const FROZEN = 5; // s without a message of the page, after which the hand does not press: the page has stopped drawing without an event
const CHANGED = "there is another object now; your hand comes back to it";

/** The services of the browser. */
export interface World {
  /** Time on the page's clock [s]. */
  now(): number;
  /** Calls `action` after a while [s]. */
  later(seconds: number, action: () => void): void;
  socket(url: string, protocol: string): WebSocket;
  post(message: FromWorker): void;
}

/** A hand and its connection, until both end. */
export class TouchClient {
  private readonly engine: TouchEngine;
  private socket: FarSocket | null = null;
  private delay = 0; // s each way, of this connection and of later ones
  private former: FarSocket | null = null; // former connection, which holds the seat until the new one has it
  private connection: Connection = { phase: "connecting", reason: "", code: 0 };
  private report_due = 0;
  private ended = false;
  private ends_at = Infinity;
  private heard_at = 0; // s; time of the newest message, or of the start of the connection
  private leaves = false; // whether the hand leaves only to join again at once
  private page_at: number; // s; time of the newest message of the page

  constructor(
    private readonly settings: TouchSettings,
    private readonly world: World,
  ) {
    this.engine = new TouchEngine(settings, world.now());
    this.page_at = world.now();
    this.connect();
    this.wake();
  }

  /** Carry out a message of the page after `start`. */
  obey(message: Exclude<ToWorker, { type: "start" }>): void {
    this.page_at = this.world.now();
    switch (message.type) {
      case "alive":
        break;
      case "point":
        this.engine.point(message.target, message.presses);
        break;
      case "hand":
        this.engine.setHand(message.hand);
        break;
      case "law":
        this.engine.setLaw(message.law, message.fixed);
        break;
      case "name":
        this.engine.setName(message.name);
        break;
      case "friction":
        this.engine.setFriction(message.mu);
        break;
      case "delay":
        this.delay = message.delay;
        if (this.socket !== null) this.socket.delay = message.delay;
        break;
      case "explain":
        this.engine.explains = message.wanted;
        break;
      case "close":
        this.engine.letGo();
        this.ends_at = this.world.now() + LONGEST_FADE;
    }
  }

  private wake(): void {
    const now = this.world.now();
    this.former?.pass(now);
    this.socket?.pass(now);
    if (this.ended) return;
    this.engine.attended = now - this.page_at <= FROZEN;
    this.run(now);
    const patience = this.connection.phase === "joined" ? GIVEN_UP : GIVEN_UP_OUTSIDE;
    if (this.socket !== null && now - this.heard_at > patience) this.lost(this.socket, ABNORMAL, "the server does not answer");
    if (now >= this.ends_at || (this.ends_at < Infinity && this.engine.free)) {
      this.end("");
      return;
    }
    if (now >= this.report_due) {
      this.report_due = now + REPORT;
      this.tell(now);
    }
    this.world.later(WAKE, () => {
      this.wake();
    });
  }

  private run(now: number): void {
    this.joinAnew();
    for (const request of [this.engine.nameRequest(), this.engine.lawRequest()]) {
      if (request !== null) this.socket?.send(request);
    }
    const sample = this.engine.advance(now);
    if (sample !== null) this.socket?.send(sample);
  }

  /**
   * Join anew if friction was switched on or off, because only the hello can ask for friction. With a secret the new
   * connection takes over the old one's seat, which after a goodbye might go to somebody else.
   */
  private joinAnew(): void {
    const bye = this.engine.toJoinAnew();
    if (bye === null || this.socket === null) return;
    if (this.settings.key === undefined) {
      this.socket.send(bye);
      this.leaves = true;
    } else {
      this.former ??= this.socket;
      this.connect();
    }
  }

  /** Close the former connection. */
  private leaveFormer(): void {
    this.former?.close(NORMAL);
    this.former = null;
  }

  private tell(now: number): void {
    const state: TouchState = this.engine.report(now, this.connection);
    this.world.post({ type: "state", state });
  }

  private connect(): void {
    if (this.ended) return;
    let open: WebSocket;
    try {
      open = this.world.socket(this.settings.url, SUBPROTOCOL);
    } catch (error) {
      this.end(`${this.settings.url} is not an address of a server: ${String(error)}`);
      return;
    }
    const socket: FarSocket = new FarSocket(open, () => this.world.now(), {
      opened: () => { socket.send(this.engine.opened()); },
      heard: (data) => { this.hear(socket, data); },
      lost: (code, reason) => { this.lost(socket, code, reason); },
    });
    socket.delay = this.delay;
    this.socket = socket;
    this.heard_at = this.world.now();
  }

  private hear(socket: FarSocket, data: Message): void {
    if (socket !== this.socket) return;
    const now = this.world.now();
    this.heard_at = now;
    try {
      const answer = this.engine.hear(data, now);
      if (answer !== null) socket.send(answer);
      if (typeof data === "string" && !this.engine.waits) this.leaveFormer();
      if (typeof data === "string") this.connection = { phase: this.engine.waits ? "connecting" : "joined", reason: "", code: 0 };
    } catch (error) {
      if (error instanceof Refused) this.refused(socket, error);
      else if (error instanceof AnotherObject) this.comeBack(socket);
      else if (error instanceof ProtocolError) this.end(`the server broke the protocol: ${error.message}`);
      else throw error;
      return;
    }
    this.run(now);
  }

  private refused(socket: FarSocket, refusal: Refused): void {
    if (refusal.code === OBJECT_CHANGED) {
      this.comeBack(socket);
      return;
    }
    // The server may not know yet that the former connection is broken; a server that stops may come back.
    const again = refusal.code === SERVER_STOPS || (refusal.code === NAME_TAKEN && this.engine.joined);
    if (again) this.lost(socket, refusal.code, refusal.message);
    else this.end(`the server refused: ${refusal.message}`, refusal.code);
  }

  private lost(socket: FarSocket, code: number, reason: string): void {
    if (socket !== this.socket || this.ended) return;
    if (code === OBJECT_CHANGED) {
      this.comeBack(socket);
      return;
    }
    this.socket = null;
    this.engine.lost();
    if (this.leaves) {
      // The server has closed, so the name is free.
      this.leaves = false;
      this.connect();
      return;
    }
    const why = reason || (code === ABNORMAL ? "no server answers" : `closed with ${code}`);
    this.connection = { phase: "connecting", reason: `${why}; trying again`, code };
    socket.close();
    this.world.later(RETRY, () => {
      this.connect();
    });
  }

  /** Join again at another object, as a new hand, once the force has faded. */
  private comeBack(socket: FarSocket): void {
    this.socket = null;
    this.leaves = false;
    socket.close(NORMAL);
    this.engine.leaveObject();
    this.connection = { phase: "connecting", reason: CHANGED, code: OBJECT_CHANGED };
    const connect = (): void => {
      if (this.ended) return;
      if (this.engine.beginAnew()) this.connect();
      else this.world.later(RETRY, connect);
    };
    this.world.later(RETRY, connect);
  }

  private end(reason: string, code = 0): void {
    if (this.ended) return;
    this.ended = true;
    const now = this.world.now();
    const socket = this.socket;
    this.socket = null;
    this.leaveFormer();
    socket?.close(NORMAL, this.engine.farewell(now));
    this.engine.letGo();
    this.connection = { phase: "closed", reason, code };
    this.tell(now);
    this.world.post({ type: "ended" });
  }
}
