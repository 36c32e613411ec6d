import { describe, expect, test } from "vitest";
import type { TouchSettings, TouchState } from "../../src/model/hand";
import { Refused, TouchEngine } from "../../src/touch/engine";
import { due } from "../../src/touch/loop/schedule";
import { DEFAULT_HAND } from "../../src/touch/loop/simulated_hand";
import { C_II, PERIOD, PlaneServer, SURFACE, WELCOME } from "./server";

const SETTINGS: TouchSettings = {
  url: "ws://127.0.0.1:1/",
  name: "page",
  law: "predictive",
  geometry: "plane",
  max_force: 10,
  friction: 0,
  passivity: true,
  hand: DEFAULT_HAND,
  target: [0.15, 0, 0],
};
const JOINED = { phase: "joined", reason: "", code: 0 } as const;

/** An engine at a server, awake every 4 ms. */
class Session {
  readonly engine: TouchEngine;
  readonly greeting: string;
  readonly server = new PlaneServer();
  now = 0;
  private nextTick = 0;

  constructor(settings = SETTINGS) {
    this.engine = new TouchEngine(settings, 0);
    this.greeting = this.engine.opened();
    this.engine.hear(JSON.stringify(WELCOME), 0);
  }

  run(seconds: number, silent = false): TouchState {
    const until = this.now + seconds;
    while (this.now < until) {
      this.now += 0.004;
      const sample = this.engine.advance(this.now);
      if (sample !== null) this.server.take(sample, this.now);
      if (this.now >= this.nextTick) {
        this.nextTick += PERIOD;
        if (!silent) this.engine.hear(this.server.patch(this.now), this.now);
      }
    }
    return this.engine.report(this.now, JOINED);
  }
}

/** Force of each period [N]. */
function sizes(trace: Float64Array): number[] {
  return Array.from({ length: trace.length / 4 }, (_, i) => trace[4 * i + 1] ?? 0);
}

describe("a cursor that presses a plane", () => {
  test("is carried by its spring against the body's, and the body gets the force", () => {
    const session = new Session();
    session.run(0.5);
    session.engine.point([SURFACE - 0.02, 0, 0]);
    const state = session.run(4);
    // Springs in series: 20 mm divided by 1 / 400 + C_ii m/N.
    const force = 0.02 / (1 / DEFAULT_HAND.stiffness + C_II);
    expect(state.doing).toBe("touching");
    expect(state.force[0]).toBeCloseTo(force, 2);
    expect(state.probe[0]).toBeCloseTo(SURFACE - C_II * force, 4);
    // The exact law: the tip stands where the body is.
    expect(state.proxy[0]).toBeCloseTo(state.probe[0], 5);
    expect(session.server.samples.at(-1)?.force[0]).toBeCloseTo(force, 2);
    expect(session.server.samples.at(-1)?.tick).toBeGreaterThan(250);
  });

  test("feels the push of others", () => {
    const session = new Session();
    session.run(0.5);
    session.engine.point([SURFACE - 0.02, 0, 0]);
    const alone = session.run(3);
    session.server.others = [0.005, 0, 0];
    const both = session.run(3);
    expect(alone.felt_from_others).toBeCloseTo(0, 6);
    expect(both.felt_from_others).toBeGreaterThan(0.5);
    expect(both.force[0]).toBeGreaterThan(alone.force[0]);
  });

  test("with friction sticks, is dragged along by others, and gives the body all of its force", () => {
    const session = new Session({ ...SETTINGS, friction: 0.8 });
    expect(JSON.parse(session.greeting)).toMatchObject({ friction: true });
    session.server.friction = true;
    session.run(0.5);
    session.engine.point([SURFACE - 0.02, 0, 0]);
    const before = session.run(3);
    expect(before.along).toBeCloseTo(0, 6);
    session.server.others = [0, 0.005, 0];
    const dragged = session.run(3);
    // Springs in series along the surface, too.
    const along = 0.005 / (1 / DEFAULT_HAND.stiffness + C_II);
    expect(dragged.force[1]).toBeCloseTo(along, 2);
    expect(dragged.along).toBeCloseTo(along, 2);
    expect(dragged.force[0]).toBeCloseTo(before.force[0], 2);
    expect(dragged.probe[1]).toBeGreaterThan(0.001);
    expect(session.server.samples.at(-1)?.force[1]).toBeCloseTo(along, 2);
    // Smooth again, without a jerk, and only then the server is told.
    session.engine.setFriction(0);
    expect(session.engine.toJoinAnew()).toBeNull();
    expect(session.run(0.1).force[1]).toBeGreaterThan(0.1);
    const { trace, force } = session.run(1);
    expect(force[1]).toBe(0);
    expect(Math.max(...sizes(trace).map((f, i, all) => Math.abs(f - (all[i - 1] ?? f))))).toBeLessThan(0.02);
    expect(JSON.parse(session.engine.toJoinAnew() ?? "")).toEqual({ type: "bye" });
  });

  test("whose device damps says how much, and nothing without the passivity layer", () => {
    expect(JSON.parse(new Session().greeting)).toMatchObject({ damping_budget: 8, friction: false });
    expect(JSON.parse(new Session().greeting)).not.toHaveProperty("key");
    expect(JSON.parse(new Session({ ...SETTINGS, key: "0123456789abcdef" }).greeting)).toMatchObject({ key: "0123456789abcdef" });
    expect(JSON.parse(new Session({ ...SETTINGS, passivity: false }).greeting)).toMatchObject({ damping_budget: 0 });
  });

  test("tells its hand, and where that would be without a force, which no force changes", () => {
    const wanted = (there: boolean): [number, number][] => {
      const session = new Session();
      if (!there) session.server.others = [-0.5, 0, 0];
      session.run(0.5);
      session.engine.point([SURFACE - 0.02, 0, 0]);
      session.run(1.5);
      session.engine.setHand({ mass: 0.15, damping: 60, stiffness: 10_000 });
      session.run(0.5);
      session.engine.point([SURFACE + 0.02, 0, 0]);
      session.run(1);
      return session.server.samples.map(({ probe, deflection, force }) => [probe[0] - (deflection ?? NaN), Math.hypot(...force)]);
    };
    const [pressing, free] = [wanted(true), wanted(false)];
    expect(Math.max(...pressing.map(([, force]) => force))).toBeGreaterThan(2);
    expect(Math.max(...free.map(([, force]) => force))).toBe(0);
    expect(pressing.length).toBe(free.length);
    for (const [i, [place]] of pressing.entries()) expect(place).toBeCloseTo(free[i]?.[0] ?? NaN, 6);
  });

  test("has no force while the server is silent, and gets it back without a step", () => {
    const session = new Session();
    session.run(0.5);
    session.engine.point([SURFACE - 0.02, 0, 0]);
    session.run(3);
    const silent = session.run(1, true);
    expect(silent.doing).toBe("server silent");
    expect(silent.force).toEqual([0, 0, 0]);
    const { trace } = session.run(2);
    let before = 0;
    for (let i = 0; i < trace.length; i += 4) {
      const size = trace[i + 1] ?? 0;
      expect(size - before).toBeLessThan(0.1);
      before = size;
    }
    expect(before).toBeGreaterThan(2);
  });

  test("lets go without a jerk, at 10 N/s, says so with a last sample without force, and goodbye", () => {
    const session = new Session();
    session.run(0.5);
    session.engine.point([SURFACE - 0.02, 0, 0]);
    const pressed = Math.hypot(...session.run(3).force);
    session.engine.letGo();
    expect(session.run(0.05).force[0]).toBeGreaterThan(pressed - 0.6);
    expect(session.engine.free).toBe(false);
    expect(session.run(1).force).toEqual([0, 0, 0]);
    expect(session.engine.free).toBe(true);
    const [sample, bye, ...more] = session.engine.farewell(session.now);
    session.server.take(sample as Uint8Array, session.now);
    expect(session.server.samples.at(-1)?.force).toEqual([0, 0, 0]);
    expect(JSON.parse(bye as string)).toEqual({ type: "bye" });
    expect(more).toEqual([]);
    expect(session.engine.farewell(session.now)).toEqual([]);
  });

  test("gives the body the law's force, without the damping that is the hand's affair", () => {
    const session = new Session();
    session.run(0.5);
    session.engine.point([SURFACE - 0.02, 0, 0]);
    session.run(1.5);
    let damped = 0;
    for (let i = 0; i < 1000; i += 1) {
      session.server.others = [0.006 * Math.sin(0.06 * i), 0, 0];
      const sent = session.server.samples.length;
      const state = session.run(0.004);
      const sample = session.server.samples[sent];
      if (sample === undefined) continue;
      expect(sample.force[0]).toBeCloseTo(state.indentation / C_II, 4);
      damped = Math.max(damped, Math.abs(state.force[0] - sample.force[0]));
    }
    expect(damped).toBeGreaterThan(0.01);
  });

  test("that leaps does not stop its hand for being too fast", () => {
    const session = new Session();
    session.run(2);
    session.engine.point([-1, 0, 0]);
    expect(session.run(1).fault).toBe("");
  });
});

describe("the engine", () => {
  test("sends one sample for each tick, which then waits a few milliseconds for it", () => {
    const session = new Session();
    session.run(5);
    const before = session.server.samples.length;
    session.run(2);
    expect(session.server.samples.length - before).toBeGreaterThanOrEqual(119);
    expect(session.server.samples.length - before).toBeLessThanOrEqual(121);
    expect(session.server.wait).toBeGreaterThan(0.001);
    expect(session.server.wait).toBeLessThan(0.01);
    const seqs = session.server.samples.map(({ seq }) => seq);
    expect(seqs).toEqual(seqs.map((_, i) => i + 1));
  });

  test("runs a thousand periods in a second, and tells each", () => {
    const session = new Session();
    session.run(0.1);
    session.engine.report(session.now, JOINED);
    const state = session.run(1);
    expect(Math.abs(state.trace.length - 4000)).toBeLessThan(4 * 5);
  });

  test("tells once by how much a tick was late, and for how long the loop stood still", () => {
    const session = new Session();
    const told = (): number[] => [session.run(1)].flatMap(({ tick_late, loop_stall }) => [tick_late, loop_stall]);
    expect(Math.max(...told())).toBeLessThan(0.005);
    session.now += 0.2; // nothing wakes the Worker, nor this server
    for (const late of told()) expect(Math.abs(late - 0.2)).toBeLessThan(0.01);
    expect(Math.max(...told())).toBeLessThan(0.005);
    session.engine.opened(); // another server counts from elsewhere
    session.engine.hear(JSON.stringify(WELCOME), session.now);
    session.server.tick = 7000;
    expect(Math.max(...told())).toBeLessThan(0.005);
  });

  test("tells the server once of another law, and runs it when patches for it come", () => {
    const session = new Session();
    session.run(0.1);
    expect(session.engine.lawRequest()).toBeNull();
    session.engine.setLaw("pi");
    expect(JSON.parse(session.engine.lawRequest() ?? "")).toEqual({ type: "set_law", law: "pi", fixed_gains: null });
    expect(session.engine.lawRequest()).toBeNull();
    expect(session.run(0.2)).toMatchObject({ law: "predictive", requested_law: "pi" });
    session.server.law = "pi";
    expect(session.run(1)).toMatchObject({ law: "pi", requested_law: "pi" });
  });

  test("asks for fixed gains, and no longer for them", () => {
    const session = new Session();
    session.run(0.1);
    const fixed_gains = { k_h: 238, integral_gain: 0 };
    session.engine.setLaw("proportional", fixed_gains);
    expect(JSON.parse(session.engine.lawRequest() ?? "")).toEqual({ type: "set_law", law: "proportional", fixed_gains });
    expect(session.engine.lawRequest()).toBeNull();
    session.engine.setLaw("proportional");
    expect(JSON.parse(session.engine.lawRequest() ?? "")).toMatchObject({ fixed_gains: null });
  });

  test("asks a new connection for the law that is asked for now", () => {
    const session = new Session();
    session.engine.lost();
    session.engine.setLaw("proportional");
    expect(session.engine.lawRequest()).toBeNull();
    expect(JSON.parse(session.engine.opened())).toMatchObject({ type: "hello", law: "proportional", name: "page" });
  });

  test("throws a refusal of the server, and a message that breaks the protocol", () => {
    const refused = new TouchEngine(SETTINGS, 0);
    refused.opened();
    const said = { type: "error", code: 4409, field: "", message: "name is 'page'; expected one that is free" };
    expect(() => {
      refused.hear(JSON.stringify(said), 0);
    }).toThrow(new Refused(4409, said.message));
    const early = new TouchEngine(SETTINGS, 0);
    early.opened();
    expect(() => {
      early.hear(new PlaneServer().patch(0), 0);
    }).toThrow('message is "patch"; expected place or called or welcome or named or error');
  });

  test("does not go on at another body", () => {
    const session = new Session();
    session.engine.opened();
    const other = { ...WELCOME, body: { ...WELCOME.body, name: "cube" } };
    expect(() => {
      session.engine.hear(JSON.stringify(other), session.now);
    }).toThrow("cube");
  });
});

test("a schedule runs the periods that have passed, at most 20 at once, and loses the rest", () => {
  const [none, same] = due(1, 0.9995);
  expect(none).toEqual([]);
  const [four, after] = due(same, 1.0035);
  expect(four.length).toBe(4);
  const [most, late] = due(after, 1.104);
  expect(most.length).toBe(20);
  expect(most.at(-1)).toBeCloseTo(1.104, 9);
  expect(late).toBeCloseTo(1.105, 9);
});
