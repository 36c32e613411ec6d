import { describe, expect, it } from "vitest";
import type { TouchState } from "../../src/model/hand";
import type { SceneSnapshot, WatchInfo } from "../../src/model/scene";
import { dot, norm, type Vec3 } from "../../src/model/vec";
import { OwnHand } from "../../src/page/own_hand";

const R = 1;
const DT = 1 / 60;
// Two walls that face each other, as the inside of a ring does: x = -0.6 and x = 0.6, seen from above between them.
const WALLS = {
  vertices: Float32Array.from([
    0.6, -1, -1, 0.6, 1, -1, 0.6, 1, 1, 0.6, -1, 1,
    -0.6, -1, -1, -0.6, 1, -1, -0.6, 1, 1, -0.6, -1, 1,
  ]),
  faces: Uint32Array.from([0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7]),
};
const INFO = { body: { center: [0, 0, 0], radius: R } } as unknown as WatchInfo;
const JOINED = { phase: "joined", doing: "free", force: [0, 0, 0], k_o: 0 } as unknown as TouchState;

/** A hand in the room, and where it was told to be. */
function inRoom(): { own: OwnHand; told: Vec3[]; run: (from: number, to: number) => void } {
  const told: Vec3[] = [];
  const own = new OwnHand(() => ({
    state: JOINED, failure: "", link: { network: null, clock_step: 0, page_wait: 0, tick_late: 0, loop_stall: 0, wavers: 0 }, point: (target: Vec3) => told.push(target), setLaw: () => undefined, setHand: () => undefined,
    alive: () => undefined, setName: () => undefined, setFriction: () => undefined, setDelay: () => undefined, explain: () => undefined, subscribe: () => () => undefined, close: () => Promise.resolve(),
  }));
  own.setBody(WALLS, INFO);
  own.start("ws://x", "ann", [0, 0, 1]);
  const run = (from: number, to: number): void => {
    for (let t = from; t < to; t += DT) own.step(null, t, DT);
  };
  return { own, told, run };
}

describe("a hand that lets go for a replay", () => {
  // From over the ring down to its inner wall at x = 0.6.
  const eye: Vec3 = [-0.3, 0, 1.5];
  const towards: Vec3 = [0.9 / Math.hypot(0.9, 1.5), 0, -1.5 / Math.hypot(0.9, 1.5)];

  it("leaves by the way by which it was seen, and never through the object", () => {
    const { own, told, run } = inRoom();
    expect(own.press(eye, towards, 0)).toBe(true);
    run(0, 3);
    const [x] = told.at(-1) ?? [0, 0, 0];
    expect(x).toBeGreaterThan(0.6); // it presses into the wall
    const before = told.length;
    own.retreat();
    run(3, 6);
    const left = told.slice(before);
    for (const [i, tip] of left.entries()) expect(tip[0]).toBeLessThanOrEqual((left[i - 1]?.[0] ?? x) + 1e-9);
    expect(norm(left.at(-1) ?? [0, 0, 0])).toBeGreaterThanOrEqual(1.3 * R - 1e-6);
    expect(dot(left.at(-1) ?? [0, 0, 0], towards)).toBeLessThan(0);
    expect(own.pressing).toBe(false);
  });

  it("presses again where it is put next", () => {
    const { own, told, run } = inRoom();
    own.press(eye, towards, 0);
    run(0, 1);
    own.retreat();
    run(1, 3);
    own.press(eye, towards, 3);
    run(3, 6);
    expect(told.at(-1)?.[0]).toBeGreaterThan(0.6);
  });
});

describe("a hand that nobody sees", () => {
  it("is off the object at once, since a page in the background draws no picture in which it could move", () => {
    const { own, told, run } = inRoom();
    own.press([0, 0, 1.5], [1 / Math.hypot(1, 1), 0, -1 / Math.hypot(1, 1)], 0);
    run(0, 2);
    own.retreat(true);
    expect(norm(told.at(-1) ?? [0, 0, 0])).toBeCloseTo(1.3 * R, 6);
    expect(own.pressing).toBe(false);
  });
});

describe("a hand that does not press", () => {
  it("gives way to a surface that others let come back, and comes no nearer by itself", () => {
    const { own, told } = inRoom();
    // Others have pressed the wall 0.2 in where the hand hovers before it.
    const dented = Float32Array.from(WALLS.vertices, (v, i) => (i % 3 === 0 && v > 0 ? v + 0.2 : v));
    const view = (positions: Float32Array): SceneSnapshot => ({ positions }) as unknown as SceneSnapshot;
    const eye: Vec3 = [-0.3, 0, 1];
    const towards: Vec3 = [1.1 / Math.hypot(1.1, 1), 0, -1 / Math.hypot(1.1, 1)];
    for (let t = 0; t < 2; t += DT) {
      own.step(view(dented), t, DT);
      if (t === 0) own.hover(eye, towards);
    }
    const [near] = told.at(-1) ?? [0, 0, 0];
    expect(near).toBeGreaterThan(0.6); // in the dent, before its ground
    for (let t = 2; t < 4; t += DT) own.step(view(WALLS.vertices), t, DT);
    expect(told.at(-1)?.[0]).toBeLessThan(0.6 - 0.05);
    for (let t = 4; t < 6; t += DT) own.step(view(dented), t, DT);
    expect(told.at(-1)?.[0]).toBeLessThan(0.6 - 0.05);
  });
});
