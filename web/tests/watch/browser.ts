/** A browser with a server at the other end of its sockets, for tests of the watching connection. */

import type { Encoding } from "../../src/model/scene";
import type { Pass } from "../../src/model/pass";
import { Watch } from "../../src/watch/connection";
import { MESH, meshFrame, N, WATCHING } from "./scenes";

/** Blocks by which every vertex moves by 1 mm/N along the force. */
function greenBlocks(count: number): ArrayBuffer {
  const size = 4 + 18 * N;
  const bytes = new Uint8Array(count * size);
  for (let k = 0; k < count; k += 1) bytes.set(new Uint8Array(greenBlock()), k * size);
  return bytes.buffer;
}

function greenBlock(): ArrayBuffer {
  const bytes = new ArrayBuffer(4 + 18 * N);
  new DataView(bytes).setFloat32(0, 1e-6, true);
  const units = new Int16Array(bytes, 4);
  for (let axis = 0; axis < 3; axis += 1) {
    for (let v = 0; v < N; v += 1) units[axis * 3 * N + 3 * v + axis] = 1000;
  }
  return bytes;
}

/** The end of a socket that a server holds. */
export class Line {
  readyState = 1;
  binaryType = "";
  onopen: (() => void) | null = null;
  onmessage: ((event: { data: string | ArrayBuffer }) => void) | null = null;
  onclose: ((event: { code: number; reason: string }) => void) | null = null;
  readonly texts: Record<string, unknown>[] = [];
  readonly acks: { tick: number; wants: number }[] = [];

  send(data: string | Uint8Array): void {
    if (typeof data === "string") {
      this.texts.push(JSON.parse(data) as Record<string, unknown>);
    } else {
      const view = new DataView(data.buffer as ArrayBuffer);
      this.acks.push({ tick: view.getUint32(4, true), wants: view.getUint8(8) });
    }
  }
  close(): void {
    this.readyState = 3;
  }
  say(message: object): void {
    this.onmessage?.({ data: JSON.stringify(message) });
  }
  frame(bytes: Uint8Array): void {
    this.onmessage?.({ data: bytes.slice().buffer });
  }
  break(code = 1006, reason = ""): void {
    this.readyState = 3;
    this.onclose?.({ code, reason });
  }
}

/** A browser in virtual time, at a server. */
export class Browser {
  time = 10;
  hidden = false;
  private timers: { at: number; action: () => void }[] = [];
  readonly lines: Line[] = [];
  readonly fetched: string[] = [];
  private answers: (() => void)[] = [];
  readonly watch: Watch;

  constructor(encoding: Encoding = "frames", pass: Pass | null = null) {
    this.watch = new Watch("http://127.0.0.1:8765/room/?x=1#y", encoding, 30, {
      now: () => this.time,
      later: (seconds, action) => this.timers.push({ at: this.time + seconds, action }),
      chance: () => 1,
      hidden: () => this.hidden,
      socket: () => {
        const line = new Line();
        this.lines.push(line);
        return line as unknown as WebSocket;
      },
      fetch: (url) => {
        this.fetched.push(url);
        return new Promise((resolve) => {
          this.answers.push(() => {
            resolve(greenBlocks(url.split(",").length));
          });
        });
      },
    }, pass);
  }

  get line(): Line {
    const line = this.lines.at(-1);
    if (line === undefined) throw new Error("no connection");
    return line;
  }

  join(watching: object = WATCHING): void {
    this.line.onopen?.();
    this.line.say(watching);
    this.line.frame(meshFrame(MESH));
  }

  run(seconds: number): void {
    this.time += seconds;
    const due = this.timers.filter(({ at }) => at <= this.time);
    this.timers = this.timers.filter(({ at }) => at > this.time);
    for (const { action } of due) action();
  }

  /** Time passes in steps, so that what a timer begins has its timers in time. */
  sleep(seconds: number): void {
    const until = this.time + seconds;
    while (this.time < until) this.run(Math.min(0.1, until - this.time));
  }

  async answer(): Promise<void> {
    while (this.answers.length > 0) {
      for (const answer of this.answers.splice(0)) answer();
      await new Promise((resolve) => setImmediate(resolve));
    }
  }
}
