import { describe, expect, test } from "vitest";
import { isLive } from "../../src/model/scene";
import { MESH, meshFrame, record, sceneFrame, WATCHING } from "./scenes";
import { Browser, type Line } from "./browser";

describe("one who watches", () => {
  test("greets, and has body, room and scene", () => {
    const browser = new Browser();
    expect(browser.watch.status.phase).toBe("connecting");
    browser.join();
    expect(browser.line.texts).toEqual([{ type: "watch", protocol: 6, encoding: "frames", rate: 30, mesh: "quantised", company: true }]);
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

  test("acknowledges a drawn frame, once", () => {
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

  test("acknowledges frames that nobody draws: at once when the page is hidden, else after a while", () => {
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
    browser.line.say({ type: "latency", user: 2, delay: 0.125, jitter: 0.02, network: "wifi" });
    expect(browser.watch.roster.map(({ name }) => name)).toEqual(["ana", "<b>bo</b>"]);
    browser.line.frame(sceneFrame(5, 100, [record(2)], 0));
    expect(browser.watch.at(browser.time)?.users[0]).toMatchObject({ name: "<b>bo</b>", latency: { delay: 0.125 } });
    browser.line.say({ type: "user_left", user: 2, name: "<b>bo</b>", reason: "bye" });
    expect(browser.watch.events.map(({ kind }) => kind)).toEqual(["joined", "latency", "left"]);
    expect(browser.watch.events[1]?.detail).toBe("wifi, 125 ms each way, up to 20 ms more");
    expect(heard).toBe(before + 3);
    stop();
    browser.line.say({ type: "user_joined", user: 3, name: "cy" });
    expect(heard).toBe(before + 3);
  });

  test("hears another name of one who is there", () => {
    const browser = new Browser();
    browser.join();
    browser.line.say({ type: "latency", user: 1, delay: 0.125, jitter: 0, network: "" });
    browser.line.say({ type: "user_joined", user: 1, name: "anna" });
    expect(browser.watch.roster).toEqual([{ user: 1, name: "anna" }]);
    expect(browser.watch.events.at(-1)).toMatchObject({ kind: "renamed", name: "ana", detail: "goes by the name anna now." });
    browser.line.frame(sceneFrame(5, 100, [record(1)], 0));
    expect(browser.watch.at(browser.time)?.users[0]).toMatchObject({ name: "anna", latency: { delay: 0.125 } });
  });

  test("asks for another view, and for latency", () => {
    const browser = new Browser();
    browser.join();
    browser.watch.setView("frames", 999);
    browser.watch.setLatency(1, { delay: 0.1, jitter: 0, network: "" });
    expect(browser.line.texts.slice(1)).toEqual([
      { type: "set_view", encoding: "frames", rate: 60 },
      { type: "set_latency", user: 1, delay: 0.1, jitter: 0, network: "" },
    ]);
  });

  test("gives orders, and hears what is kept from the object until it connects anew", () => {
    const browser = new Browser();
    browser.join();
    browser.watch.order("ban", 7);
    browser.watch.order("freeze");
    expect(browser.line.texts.slice(1)).toEqual([
      { type: "moderate", action: "ban", user: 7 },
      { type: "moderate", action: "freeze", user: null },
    ]);
    browser.line.say({ type: "moderated", action: "ban", user: 7, done: false });
    browser.line.say({ type: "restraints", frozen: true, muted: [1, 9] });
    expect(browser.watch.restraints).toEqual({ frozen: true, muted: [1, 9] });
    browser.line.say({ type: "restraints", frozen: false, muted: [] });
    expect(browser.watch.events.map(({ detail }) => detail)).toEqual([
      "The object is frozen.", "is muted.", "The object takes forces again.", "is not muted any more.",
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
    browser.line.say({ type: "error", code: 4426, field: "", message: "protocol version is 2; expected 6" });
    expect(browser.watch.status).toMatchObject({ phase: "refused", reason: "protocol version is 2; expected 6", code: 4426 });
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
    ["a message for those who touch", (line: Line) => { line.say({ ...WATCHING, type: "welcome" }); }],
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

describe("one who has an invitation", () => {
  function pass(): { token: string | undefined; kept: string[]; keep(session: string): void; forget(): boolean } {
    return {
      token: "invitation",
      kept: [],
      keep(session) { this.kept.push(session); this.token = session; },
      forget() { const left = this.token === "session"; this.token = "invitation"; return left; },
    };
  }

  test("says it first, and comes back with its session", () => {
    const mine = pass();
    const browser = new Browser("frames", mine);
    browser.line.onopen?.();
    expect(browser.line.texts).toMatchObject([{ type: "watch", token: "invitation" }]);
    browser.line.say({ ...WATCHING, session: "session" });
    expect(mine.kept).toEqual(["session"]);
    browser.line.break();
    browser.run(30);
    browser.line.onopen?.();
    expect(browser.line.texts).toMatchObject([{ type: "watch", token: "session" }]);
  });

  test("tries the invitation once more where the session is refused, and then gives up", () => {
    const mine = pass();
    mine.token = "session";
    const browser = new Browser("frames", mine);
    browser.line.onopen?.();
    browser.line.break(4401, "the token ended 2 days ago");
    expect(browser.watch.status.phase).toBe("waiting");
    browser.run(30);
    browser.line.onopen?.();
    expect(browser.line.texts).toMatchObject([{ type: "watch", token: "invitation" }]);
    browser.line.break(4401, "the token was used before");
    expect(browser.watch.status).toMatchObject({ phase: "refused", code: 4401, reason: "the token was used before" });
  });

  test("is not asked again where it may not come in", () => {
    const browser = new Browser("frames", pass());
    browser.line.onopen?.();
    browser.line.break(4403, "the token is for the room lab");
    browser.run(60);
    expect(browser.lines.length).toBe(1);
    expect(browser.watch.status.phase).toBe("refused");
  });
});

describe("silence", () => {
  test("is measured from the newest word, and a connection that says nothing more is given up for a new one", () => {
    const browser = new Browser();
    expect(browser.watch.status.silent).toBe(0);
    browser.join();
    browser.run(3);
    expect(browser.watch.status.silent).toBeCloseTo(3, 6);
    expect(isLive(browser.watch.status)).toBe(false);
    expect(browser.lines.length).toBe(1);
    browser.run(2.1);
    expect(browser.watch.status.phase).toBe("waiting");
    browser.run(1);
    expect(browser.lines.length).toBe(2);
    browser.join();
    expect(isLive(browser.watch.status)).toBe(true);
    expect(browser.watch.status.silent).toBe(0);
  });

  test("of a line that is slow is no reason to ask anew while the resting mesh is on its way", () => {
    const browser = new Browser();
    browser.line.onopen?.();
    browser.sleep(8);
    browser.line.say(WATCHING);
    browser.sleep(31); // a server takes a page for too slow after 30 s
    expect(browser.lines.length).toBe(1);
    browser.line.frame(meshFrame(MESH));
    expect(browser.watch.status.phase).toBe("watching");
    browser.sleep(4.9);
    expect(browser.lines.length).toBe(1);
    browser.sleep(1);
    expect(browser.lines.length).toBe(2);
  });

  test("before the first word, and in the middle of the mesh, ends a connection as well", () => {
    const browser = new Browser();
    browser.line.onopen?.();
    browser.sleep(11);
    expect(browser.lines.length).toBe(2);
    browser.line.onopen?.();
    browser.line.say(WATCHING);
    browser.sleep(37);
    expect(browser.lines.length).toBe(3);
  });
});
