/** A client in virtual time, whose server is the test. */

import type { TouchState } from "../../src/model/hand";
import { TouchClient } from "../../src/touch/client";
import { DEFAULT_HAND } from "../../src/touch/loop/simulated_hand";
import type { FromWorker } from "../../src/touch/worker_messages";
import { PERIOD, PlaneServer, WELCOME } from "./server";

/** The end of a socket that a server holds. */
export class Line {
  /** @param way Brings something to the other end, which may be far away. */
  constructor(private readonly now: () => number, private readonly way: (action: () => void) => void) {}
  readyState = 1;
  bufferedAmount = 0;
  binaryType = "";
  onopen: (() => void) | null = null;
  onmessage: ((event: { data: string | ArrayBuffer }) => void) | null = null;
  onclose: ((event: { code: number; reason: string }) => void) | null = null;
  readonly texts: { type: string }[] = [];
  readonly server = new PlaneServer();
  closed: number | null = null;

  send(data: string | Uint8Array): void {
    if (typeof data === "string") this.texts.push(JSON.parse(data) as { type: string });
    else this.way(() => { this.server.take(data, this.now()); });
  }
  close(code = 1000): void {
    this.closed ??= code;
    this.readyState = 3;
  }
  say(message: object): void {
    this.onmessage?.({ data: JSON.stringify(message) });
  }
  patch(t: number): void {
    const patch = this.server.patch(t).slice().buffer;
    this.way(() => { this.onmessage?.({ data: patch }); });
  }
  break(code = 1006, reason = ""): void {
    this.readyState = 3;
    this.onclose?.({ code, reason });
  }
}

/** A browser in virtual time. */
export class Browser {
  time = 0;
  /** Of the server, each way [s]. */
  far = 0;
  private timers: { at: number; action: () => void }[] = [];
  readonly lines: Line[] = [];
  readonly posts: FromWorker[] = [];
  readonly client: TouchClient;

  /** @param key The page's secret; every page has one. */
  constructor(key?: string) {
    this.client = this.begin(key);
  }

  private readonly begin = (key?: string): TouchClient => new TouchClient(
    {
      ...(key === undefined ? {} : { key }),
      url: "ws://127.0.0.1:1/",
      name: "page",
      law: "predictive",
      geometry: "plane",
      max_force: 10,
      friction: 0,
      passivity: true,
      hand: DEFAULT_HAND,
      target: [0.15, 0, 0],
    },
    {
      now: () => this.time,
      later: (seconds, action) => this.timers.push({ at: this.time + Math.max(0.001, seconds), action }),
      socket: () => {
        const line = new Line(() => this.time, (action) => {
          if (this.far > 0) this.timers.push({ at: this.time + this.far, action });
          else action();
        });
        this.lines.push(line);
        return line as unknown as WebSocket;
      },
      post: (message) => this.posts.push(message),
    },
  );

  run(seconds: number, ticking = true): void {
    const until = this.time + seconds;
    let tick = this.time;
    while (this.time < until) {
      this.time += 0.001;
      const due = this.timers.filter(({ at }) => at <= this.time);
      this.timers = this.timers.filter(({ at }) => at > this.time);
      for (const { action } of due) action();
      if (ticking && this.time >= tick) {
        tick += PERIOD;
        this.line.patch(this.time);
      }
    }
  }

  get line(): Line {
    const line = this.lines.at(-1);
    if (line === undefined) throw new Error("no connection");
    return line;
  }

  get state(): TouchState {
    const states = this.posts.flatMap((post) => (post.type === "state" ? [post.state] : []));
    const state = states.at(-1);
    if (state === undefined) throw new Error("no report");
    return state;
  }

  join(): void {
    this.line.onopen?.();
    this.line.say(WELCOME);
    this.run(0.5);
  }
}
