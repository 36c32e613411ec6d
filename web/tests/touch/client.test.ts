import { describe, expect, test } from "vitest";
import { Browser, type Line } from "./browser";
import { WELCOME } from "./server";

describe("a client", () => {
  test("says hello, joins, sends samples and reports sixty times a second", () => {
    const browser = new Browser();
    browser.run(0.1, false);
    expect(browser.state).toMatchObject({ phase: "connecting", doing: "connecting" });
    browser.join();
    expect(browser.line.texts).toMatchObject([{ type: "hello", max_stiffness: 2000 }]);
    expect(browser.state).toMatchObject({ phase: "joined", user: 3, name: "page" });
    const [posts, samples] = [browser.posts.length, browser.line.server.samples.length];
    browser.run(1);
    expect(browser.posts.length - posts).toBeGreaterThan(50);
    expect(browser.posts.length - posts).toBeLessThan(65);
    expect(browser.line.server.samples.length - samples).toBeGreaterThan(58);
  });

  test("connects again half a second after the connection broke, and goes on", () => {
    const browser = new Browser();
    browser.join();
    browser.line.break();
    browser.run(0.3, false);
    expect(browser.lines.length).toBe(1);
    expect(browser.state).toMatchObject({ phase: "connecting", reason: "no server answers; trying again" });
    browser.run(0.3, false);
    expect(browser.lines.length).toBe(2);
    browser.join();
    expect(browser.state.phase).toBe("joined");
  });

  test("takes its own name for its own, when it was there before", () => {
    const browser = new Browser();
    browser.join();
    browser.line.break();
    browser.run(0.6, false);
    browser.line.onopen?.();
    browser.line.say({ type: "error", code: 4409, field: "", message: "name is taken" });
    browser.run(0.6, false);
    expect(browser.lines.length).toBe(3);
  });

  test("presses on while its page says that it runs, and not for a page that stands still", () => {
    const browser = new Browser();
    browser.join();
    browser.run(0.5);
    browser.client.obey({ type: "point", target: [0.08, 0, 0], presses: true });
    for (let second = 0; second < 12; second++) {
      browser.run(1);
      browser.client.obey({ type: "alive" });
    }
    const pressed = browser.state;
    expect(pressed.doing).toBe("touching");
    expect(pressed.force[0]).toBeGreaterThan(2);
    browser.run(4.5);
    expect(browser.state.force[0]).toBeCloseTo(pressed.force[0], 3); // a page may be slow
    browser.run(3.5);
    expect(Math.hypot(...browser.state.force)).toBeLessThan(0.15);
    // Once the page goes on, its hand is where it was; the page decides whether it stays there.
    browser.client.obey({ type: "alive" });
    browser.run(3);
    expect(browser.state.force[0]).toBeCloseTo(pressed.force[0], 2);
  });

  test("ends when it is refused, and says why", () => {
    const browser = new Browser();
    browser.line.onopen?.();
    browser.line.say({ type: "error", code: 4429, field: "", message: "the room is full" });
    expect(browser.state).toMatchObject({ phase: "closed", reason: "the server refused: the room is full", code: 4429 });
    expect(browser.posts.at(-1)).toEqual({ type: "ended" });
    browser.run(2, false);
    expect(browser.lines.length).toBe(1);
  });

  test("that comes while a server stops tries again", () => {
    const browser = new Browser();
    browser.line.onopen?.();
    browser.line.say({ type: "error", code: 4503, field: "", message: "it stops" });
    browser.run(2, false);
    expect([browser.state.phase, browser.lines.length]).toEqual(["connecting", 2]);
  });

  test("ends when the server breaks the protocol", () => {
    const browser = new Browser();
    browser.line.onopen?.();
    browser.line.say({ type: "welcome" });
    expect(browser.state.phase).toBe("closed");
    expect(browser.state.reason).toContain("the server broke the protocol: protocol is undefined");
  });

  test("fades before it says goodbye, and without a force does so at once", () => {
    const browser = new Browser();
    browser.join();
    browser.client.obey({ type: "point", target: [0.08, 0, 0], presses: true });
    browser.run(2);
    const force = Math.hypot(...browser.state.force);
    expect(force).toBeGreaterThan(2);
    browser.client.obey({ type: "close" });
    browser.run(0.9 * (force / 10));
    expect(browser.line.closed).toBeNull();
    browser.run(1.1 - 0.9 * (force / 10));
    expect(Math.hypot(...browser.state.force)).toBe(0);
    const free = new Browser();
    free.join();
    free.client.obey({ type: "close" });
    free.run(0.01);
    expect(free.line.closed).toBe(1000);
    expect(browser.line.texts.at(-1)).toEqual({ type: "bye" });
    expect(browser.line.closed).toBe(1000);
    expect(browser.posts.at(-1)).toEqual({ type: "ended" });
  });

  test("that is to have friction leaves and comes in again once the server has closed, without letting go", () => {
    const browser = new Browser();
    browser.join();
    browser.client.obey({ type: "point", target: [0.08, 0, 0], presses: true });
    browser.run(2);
    const [before, old] = [Math.hypot(...browser.state.force), browser.line];
    browser.client.obey({ type: "friction", mu: 0.4 });
    browser.run(0.03, false);
    expect(old.texts.at(-1)).toEqual({ type: "bye" });
    expect(browser.lines.length).toBe(1);
    old.break(1000, "bye");
    browser.line.onopen?.();
    expect(browser.line.texts).toMatchObject([{ type: "hello", friction: true, name: "page" }]);
    browser.line.say(WELCOME);
    browser.run(0.5);
    expect(browser.state).toMatchObject({ phase: "joined", reason: "", doing: "touching" });
    expect(Math.hypot(...browser.state.force)).toBeCloseTo(before, 1);
    // From one coefficient to another nobody needs to be told.
    browser.client.obey({ type: "friction", mu: 0.8 });
    browser.run(0.5);
    expect(browser.lines.length).toBe(2);
    expect(browser.line.texts.length).toBe(1);
  });

  test("that is to have friction keeps its seat where it has a secret: the new connection takes the old one's place", () => {
    const browser = new Browser("a".repeat(16));
    browser.join();
    browser.client.obey({ type: "point", target: [0.08, 0, 0], presses: true });
    browser.run(2);
    const [before, old] = [Math.hypot(...browser.state.force), browser.line];
    browser.client.obey({ type: "friction", mu: 0.4 });
    browser.run(0.03, false);
    // To leave first would give the seat to whoever waits for one.
    expect(old.texts.filter(({ type }) => type === "bye")).toEqual([]);
    expect(old.closed).toBeNull();
    expect(browser.lines.length).toBe(2);
    browser.line.onopen?.();
    expect(browser.line.texts).toMatchObject([{ type: "hello", friction: true, name: "page", key: "a".repeat(16) }]);
    old.say({ type: "error", code: 4400, field: "", message: "user is 'page'; expected its only connection" });
    old.break(4400);
    browser.line.say(WELCOME);
    browser.run(0.5);
    expect(browser.state).toMatchObject({ phase: "joined", reason: "", doing: "touching" });
    expect(Math.hypot(...browser.state.force)).toBeCloseTo(before, 1);
    expect(browser.lines.length).toBe(2);
  });

  test("that ends meanwhile leaves none of its connections open", () => {
    const browser = new Browser("a".repeat(16));
    browser.join();
    browser.client.obey({ type: "friction", mu: 0.4 });
    browser.run(0.03, false);
    browser.client.obey({ type: "close" });
    browser.run(0.1, false);
    expect(browser.lines.map(({ closed }) => closed)).toEqual([1000, 1000]);
  });

  test.each([
    ["told", (line: Line) => { line.say({ type: "error", code: 4410, field: "", message: "there is another object now" }); }],
    ["closed", (line: Line) => { line.break(4410, "there is another object now"); }],
  ])("that presses as the object changes (%s) comes back by itself, engaged once it is free of the new one", (_, change) => {
    const browser = new Browser();
    browser.join();
    browser.client.obey({ type: "point", target: [0.08, 0, 0], presses: true });
    browser.run(2);
    const forces = [Math.hypot(...browser.state.force)];
    expect(forces[0]).toBeGreaterThan(2);
    // Traces have every period: the force of each, in turn.
    const from = browser.posts.length;
    const old = browser.line;
    change(old);
    browser.run(3, false);
    expect(browser.lines.length).toBe(2);
    const body = { ...WELCOME.body, name: "another", radius: 0.2, contact_radius: 0.01 };
    browser.line.onopen?.();
    browser.line.say({ ...WELCOME, simulation_period: 0.02, body });
    browser.run(1);
    // The hand lies in the new object too: no force before it was out of it.
    expect(browser.state).toMatchObject({ phase: "joined", reason: "", doing: "waiting", scale: 0 });
    browser.client.obey({ type: "point", target: [0.15, 0, 0], presses: true });
    browser.run(0.5);
    browser.client.obey({ type: "point", target: [0.08, 0, 0], presses: true });
    browser.run(2);
    expect(browser.state).toMatchObject({ phase: "joined", doing: "touching", simulation_period: 0.02 });
    for (const post of browser.posts.slice(from)) {
      if (post.type !== "state") continue;
      for (let i = 1; i < post.state.trace.length; i += 4) forces.push(post.state.trace[i] ?? NaN);
    }
    expect(forces.at(-1)).toBeCloseTo(forces[0] ?? 0, 0);
    const jumps = forces.slice(1).map((force, i) => Math.abs(force - (forces[i] ?? 0)));
    // A millisecond's worth of the limit for what the hand's own motion does not cause is 0.02 N.
    expect(Math.max(...jumps)).toBeLessThan(0.1);
    expect(Math.min(...forces)).toBe(0);
  });

  test("that reaches another object than it left, with no word of it, begins anew as well", () => {
    const browser = new Browser();
    browser.join();
    browser.client.obey({ type: "point", target: [0.08, 0, 0], presses: true });
    browser.run(2);
    browser.line.break();
    browser.run(0.6, false);
    browser.line.onopen?.();
    browser.line.say({ ...WELCOME, body: { ...WELCOME.body, name: "another" } });
    browser.run(3, false);
    expect(browser.lines.length).toBe(3);
    browser.line.onopen?.();
    browser.line.say({ ...WELCOME, body: { ...WELCOME.body, name: "another" } });
    browser.run(0.5);
    expect(browser.state).toMatchObject({ phase: "joined", doing: "waiting" });
  });

  test("waits for a seat as long as the server repeats its place, though nothing else is said, and gives a dead one up", () => {
    const browser = new Browser();
    browser.line.onopen?.();
    for (let i = 0; i < 10; i += 1) {
      browser.line.say({ type: "place", place: 2, of: 3 });
      browser.run(i % 2 === 0 ? 2 : 7, false);
    }
    expect(browser.lines.length).toBe(1);
    expect(browser.state).toMatchObject({ phase: "connecting", place: [2, 3], reason: "" });
    browser.run(3.1 + 0.6, false);
    expect(browser.lines.length).toBe(2);
    expect(browser.lines[0]?.closed).not.toBeNull();
    expect(browser.state.reason).toContain("the server does not answer");
    browser.line.onopen?.();
    browser.line.say({ type: "place", place: 3, of: 3 });
    browser.run(0.1, false);
    expect(browser.state).toMatchObject({ phase: "connecting", place: [3, 3], reason: "" });
  });

  test("goes by another name without leaving, in the room and in the queue, and keeps its own where it cannot", () => {
    const browser = new Browser();
    browser.line.onopen?.();
    browser.line.say({ type: "place", place: 1, of: 1 });
    browser.client.obey({ type: "name", name: "ann" });
    browser.run(0.01, false);
    expect(browser.line.texts.slice(1)).toEqual([{ type: "set_name", name: "ann" }]);
    browser.line.say({ type: "named", name: "ann", reason: "" });
    browser.run(0.1, false);
    expect(browser.state).toMatchObject({ phase: "connecting", place: [1, 1], name: "ann", name_refused: "" });
    browser.line.say({ ...WELCOME, name: "ann" });
    browser.run(0.5);
    browser.client.obey({ type: "name", name: "bob" });
    browser.run(0.1);
    expect(browser.line.texts.at(-1)).toEqual({ type: "set_name", name: "bob" });
    browser.line.say({ type: "named", name: "ann", reason: "name is 'bob'; expected one that is free" });
    browser.run(0.1);
    expect(browser.state).toMatchObject({ phase: "joined", name: "ann", name_refused: "name is 'bob'; expected one that is free" });
    expect(browser.lines.length).toBe(1);
    // It comes back by the name that it has.
    browser.line.break();
    browser.run(0.6, false);
    browser.line.onopen?.();
    expect(browser.line.texts).toMatchObject([{ type: "hello", name: "ann" }]);
  });

  test("comes back to the queue with the session that its first place brought", () => {
    const browser = new Browser();
    browser.line.onopen?.();
    browser.line.say({ type: "place", place: 1, of: 1, session: "a.session.token" });
    browser.line.say({ type: "place", place: 1, of: 2 });
    browser.line.break();
    browser.run(0.6, false);
    browser.line.onopen?.();
    expect(browser.line.texts).toMatchObject([{ type: "hello", token: "a.session.token" }]);
  });

  test("that is in the room gives up a server that says nothing for five seconds", () => {
    const browser = new Browser();
    browser.join();
    browser.run(4.9, false);
    expect(browser.lines.length).toBe(1);
    browser.run(0.8, false);
    expect(browser.lines.length).toBe(2);
  });

  test("leaves a sample out while the one before is not out yet", () => {
    const browser = new Browser();
    browser.join();
    const samples = browser.line.server.samples.length;
    browser.line.bufferedAmount = 44;
    browser.run(0.5);
    expect(browser.line.server.samples.length).toBe(samples);
  });
});
