import { describe, expect, test } from "vitest";
import { greenUrl, socketUrl } from "../../src/address";
import type { Encoding } from "../../src/model/scene";
import { Watch } from "../../src/watch/connection";
import { MESH, meshFrame, N, record, sceneFrame, WATCHING } from "./scenes";

/** The end of a socket that a server holds. */
class Line {
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
class Browser {
  time = 10;
  hidden = false;
  private timers: { at: number; action: () => void }[] = [];
  readonly lines: Line[] = [];
  readonly fetched: string[] = [];
  private answers: (() => void)[] = [];
  readonly watch: Watch;

  constructor(encoding: Encoding = "frames") {
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
            resolve(greenBlock());
          });
        });
      },
    });
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

  async answer(): Promise<void> {
    while (this.answers.length > 0) {
      for (const answer of this.answers.splice(0)) answer();
      await new Promise((resolve) => setImmediate(resolve));
    }
  }
}

/** Every vertex moves by 1 mm/N along the force. */
function greenBlock(): ArrayBuffer {
  const bytes = new ArrayBuffer(4 + 18 * N);
  new DataView(bytes).setFloat32(0, 1e-6, true);
  const units = new Int16Array(bytes, 4);
  for (let axis = 0; axis < 3; axis += 1) {
    for (let v = 0; v < N; v += 1) units[axis * 3 * N + 3 * v + axis] = 1000;
  }
  return bytes;
}

describe("one who watches", () => {
  test("greets, and has body, room and scene", () => {
    const browser = new Browser();
    expect(browser.watch.status.phase).toBe("connecting");
    browser.join();
    expect(browser.line.texts).toEqual([{ type: "watch", protocol: 3, encoding: "frames", rate: 30 }]);
    expect(browser.watch.status.phase).toBe("watching");
    expect(browser.watch.mesh?.vertices).toEqual(MESH.vertices);
    expect(browser.watch.info?.body.name).toBe("balloon");
    expect(browser.watch.roster).toEqual([{ user: 1, name: "ana" }]);
    expect(browser.watch.at(browser.time)).toBeNull();
    browser.line.frame(sceneFrame(5, 100, [record(1)], 100));
    const view = browser.watch.at(browser.time);
    expect(view?.positions[0]).toBeCloseTo(0.101, 6);
    expect(view?.users).toMatchObject([{ user: 1, name: "ana", latency: { delay: 0, jitter: 0 } }]);
    expect(view?.moved).toBe(true);
    expect(browser.watch.at(browser.time)?.moved).toBe(false);
  });

  test("acknowledges what is drawn, once", () => {
    const browser = new Browser();
    browser.join();
    browser.line.frame(sceneFrame(5, 100, [], 0));
    expect(browser.line.acks).toEqual([]);
    browser.watch.at(browser.time);
    browser.watch.at(browser.time);
    expect(browser.line.acks).toEqual([{ tick: 5, wants: 0 }]);
    browser.line.frame(sceneFrame(6, 100.01, [], 0));
    browser.line.frame(sceneFrame(7, 100.02, [], 0));
    browser.watch.at(browser.time);
    expect(browser.line.acks.at(-1)).toEqual({ tick: 7, wants: 0 });
    expect(browser.line.acks.length).toBe(2);
  });

  test("acknowledges what nobody draws: at once when the page is hidden, else after a while", () => {
    const browser = new Browser();
    browser.join();
    browser.line.frame(sceneFrame(5, 100, [], 0));
    browser.run(0.3);
    expect(browser.line.acks).toEqual([{ tick: 5, wants: 0 }]);
    browser.hidden = true;
    browser.line.frame(sceneFrame(6, 100.1, [], 0));
    expect(browser.line.acks.length).toBe(2);
  });

  test("interpolates between frames", () => {
    const browser = new Browser();
    browser.join();
    for (let i = 0; i < 60; i += 1) {
      browser.time += 1 / 30;
      browser.line.frame(sceneFrame(5 + 2 * i, 100 + i / 30, [record(1, 0.001 * i)], 10 * i));
    }
    const now = browser.time;
    const xs = [0, 0.01, 0.02, 0.03].map((later) => browser.watch.at(now + later)?.positions[0] ?? NaN);
    // A tenth of a millimetre in a thirtieth of a second.
    for (let i = 1; i < xs.length; i += 1) expect((xs[i] ?? 0) - (xs[i - 1] ?? 0)).toBeCloseTo(3e-5, 6);
    expect(browser.watch.status.frames).toBe(60);
    expect(browser.watch.status.frames_per_second).toBeCloseTo(30, -1);
    expect(browser.watch.history(1)?.force.length).toBe(60);
  });

  test("hears who comes, who goes and who is delayed", () => {
    const browser = new Browser();
    let heard = 0;
    const stop = browser.watch.subscribe(() => {
      heard += 1;
    });
    browser.join();
    const before = heard;
    browser.line.say({ type: "user_joined", user: 2, name: "<b>bo</b>" });
    browser.line.say({ type: "latency", user: 2, delay: 0.125, jitter: 0.02 });
    expect(browser.watch.roster.map(({ name }) => name)).toEqual(["ana", "<b>bo</b>"]);
    browser.line.frame(sceneFrame(5, 100, [record(2)], 0));
    expect(browser.watch.at(browser.time)?.users[0]).toMatchObject({ name: "<b>bo</b>", latency: { delay: 0.125 } });
    browser.line.say({ type: "user_left", user: 2, name: "<b>bo</b>", reason: "bye" });
    expect(browser.watch.events.map(({ kind }) => kind)).toEqual(["joined", "latency", "left"]);
    expect(browser.watch.events[1]?.detail).toBe("125 ms each way, up to 20 ms more");
    expect(heard).toBe(before + 3);
    stop();
    browser.line.say({ type: "user_joined", user: 3, name: "cy" });
    expect(heard).toBe(before + 3);
  });

  test("asks for another view, and for latency", () => {
    const browser = new Browser();
    browser.join();
    browser.watch.setView("frames", 999);
    browser.watch.setLatency(1, { delay: 0.1, jitter: 0 });
    expect(browser.line.texts.slice(1)).toEqual([
      { type: "set_view", encoding: "frames", rate: 60 },
      { type: "set_latency", user: 1, delay: 0.1, jitter: 0 },
    ]);
  });

  test("says so later when the view was changed while it was joining", () => {
    const browser = new Browser();
    browser.line.onopen?.();
    browser.watch.setView("forces", 10);
    expect(browser.line.texts.length).toBe(1);
    browser.line.say(WATCHING);
    browser.line.frame(meshFrame(MESH));
    expect(browser.line.texts.at(-1)).toEqual({ type: "set_view", encoding: "forces", rate: 10 });
  });
});

describe("a connection that is lost", () => {
  test("comes back, later each time, and the scene stays until then", () => {
    const browser = new Browser();
    browser.join();
    browser.line.frame(sceneFrame(5, 100, [record(1)], 100));
    browser.line.break();
    expect(browser.watch.status).toMatchObject({ phase: "waiting", reason: "no server answers", retry_at: 10.5 });
    expect(browser.watch.at(browser.time + 1)?.users.length).toBe(1);
    browser.run(0.5);
    expect(browser.lines.length).toBe(2);
    browser.line.break();
    expect(browser.watch.status.retry_at).toBeCloseTo(11.5, 9);
    browser.run(1);
    const mesh = browser.watch.mesh;
    browser.join();
    // A server that was started anew counts from 1, on another clock.
    browser.line.frame(sceneFrame(1, 3, [], 0));
    expect(browser.watch.status.phase).toBe("watching");
    expect(browser.watch.mesh).toBe(mesh);
    expect(browser.watch.at(browser.time)?.positions[0]).toBeCloseTo(0.1, 6);
  });

  test("is not tried again where that would change nothing", () => {
    const browser = new Browser();
    browser.line.onopen?.();
    browser.line.say({ type: "error", code: 4426, message: "protocol version is 2; expected 3" });
    expect(browser.watch.status).toMatchObject({ phase: "refused", reason: "protocol version is 2; expected 3", code: 4426 });
    browser.run(60);
    expect(browser.lines.length).toBe(1);
  });

  test.each([
    ["a scene before the mesh", (line: Line) => { line.say(WATCHING); line.frame(sceneFrame(1, 1, [], null)); }],
    ["a tick that does not rise", (line: Line) => {
      line.say(WATCHING);
      line.frame(meshFrame(MESH));
      line.frame(sceneFrame(2, 1, [], null));
      line.frame(sceneFrame(2, 1, [], null));
    }],
    ["what is for those who touch", (line: Line) => { line.say({ ...WATCHING, type: "welcome" }); }],
    ["bytes of nothing", (line: Line) => { line.frame(Uint8Array.of(2)); }],
  ])("%s breaks the protocol", (_, offend) => {
    const browser = new Browser();
    browser.line.onopen?.();
    offend(browser.line);
    expect(browser.watch.status.phase).toBe("waiting");
    expect(browser.watch.status.reason).toContain("the server broke the protocol");
  });

  test("that was closed stays closed", () => {
    const browser = new Browser();
    browser.join();
    browser.watch.close();
    browser.line.break();
    browser.run(60);
    expect(browser.lines.length).toBe(1);
  });
});

describe("a surface from forces", () => {
  test("is had in frames until the blocks are here", async () => {
    const browser = new Browser("forces");
    browser.join();
    browser.line.frame(sceneFrame(1, 100, [record(1)], null));
    expect(browser.fetched[0]).toBe(`http://127.0.0.1:8765/room/v1/models/${WATCHING.model}/green/0`);
    browser.watch.at(browser.time);
    expect(browser.line.acks).toEqual([{ tick: 1, wants: 1 }]);
    expect(browser.watch.status.encoding).toBe("frames");
    browser.line.frame(sceneFrame(2, 100.01, [record(1)], -100));
    expect(browser.watch.at(browser.time + 1)?.positions[0]).toBeCloseTo(0.099, 6);
    await browser.answer();
    browser.line.frame(sceneFrame(3, 100.02, [record(1)], null));
    // 1 N on the hand is 1 N into the body, a millimetre per newton.
    expect(browser.watch.at(browser.time + 2)?.positions[0]).toBeCloseTo(0.099, 6);
    expect(browser.line.acks.at(-1)).toEqual({ tick: 3, wants: 0 });
    expect(browser.watch.status).toMatchObject({ encoding: "forces", blocks_wanted: 0 });
  });

  test("is shown as soon as the blocks come, without another frame", async () => {
    const browser = new Browser("forces");
    browser.join();
    browser.line.frame(sceneFrame(1, 100, [record(1)], null));
    expect(browser.watch.at(browser.time + 1)?.positions[0]).toBeCloseTo(0.1, 6);
    await browser.answer();
    const view = browser.watch.at(browser.time + 1);
    expect(view?.positions[0]).toBeCloseTo(0.099, 6);
    expect(view?.moved).toBe(true);
  });

  test("is in frames for ever where the body has no model", () => {
    const browser = new Browser("forces");
    browser.join({ ...WATCHING, model: null });
    browser.line.frame(sceneFrame(1, 100, [record(1)], -100));
    browser.watch.at(browser.time);
    expect(browser.fetched).toEqual([]);
    expect(browser.line.acks).toEqual([{ tick: 1, wants: 0 }]);
    expect(browser.watch.status.encoding).toBe("frames");
  });
});

test("a page finds its server under its own path", () => {
  expect(socketUrl("https://lab.example/touch/index.html?a#b")).toBe("wss://lab.example/touch/");
  expect(socketUrl("ws://127.0.0.1:8765")).toBe("ws://127.0.0.1:8765/");
  expect(greenUrl("wss://lab.example/touch/", "ab", 7)).toBe("https://lab.example/touch/v1/models/ab/green/7");
});
