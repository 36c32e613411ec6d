import { describe, expect, it } from "vitest";
import { norm, type Vec3, ZERO } from "../../../src/model/vec";
import { DEFAULT_HAND } from "../../../src/touch/loop/simulated_hand";
import { type CursorState, follow, restAt } from "../../../src/touch/loop/device";

const DT = 1e-3; // s
const STIFFNESS = 300; // N/m, of the surface
const SPEED = 0.06; // m/s at which it comes back, as fast as those of hands that let go
const HEIGHT = 0.03; // m that it comes back by
const CLEAR = 0.008; // m that the hand is over the dented surface

/** The largest force, the last height of the tip, and how often it was touched anew. */
function comesBack(presses: boolean, seconds = 3): { most: number; height: number; touches: number } {
  const cursor: Vec3 = [0, 0, CLEAR];
  let state: CursorState = restAt(cursor);
  let [force, most, touches]: [Vec3, number, number] = [ZERO, 0, 0];
  for (let i = 0; i < seconds / DT; i += 1) {
    state = follow(state, DEFAULT_HAND, cursor, presses, force, DT);
    const depth = Math.min(HEIGHT, SPEED * i * DT) - state.tip.position[2];
    const before = force[2];
    force = [0, 0, Math.max(0, STIFFNESS * depth)];
    if (before === 0 && force[2] > 0) touches += 1;
    most = Math.max(most, force[2]);
  }
  return { most, height: state.tip.position[2], touches };
}

describe("a hand in the way of a surface that comes back, while the page says nothing new", () => {
  it("is pressed where it stands if it presses", () => {
    const { most, height } = comesBack(true);
    expect(most).toBeGreaterThan(2);
    expect(height).toBeLessThan(HEIGHT);
  });

  it("gives way if it does not, and is not touched over and over", () => {
    const { most, touches } = comesBack(false);
    expect(most).toBeLessThan(0.3);
    expect(touches).toBeLessThan(12);
  });

  it.each([100, 300, 1500])("comes to rest in a gap, one side of which came to it (%d N/m)", (stiffness) => {
    let [state, force, late]: [CursorState, Vec3, number] = [restAt(ZERO), ZERO, 0];
    for (let i = 0; i < 4 / DT; i += 1) {
      state = follow(state, DEFAULT_HAND, ZERO, false, force, DT);
      const height = state.tip.position[2];
      const [below, above] = [Math.min(0.001, SPEED * i * DT - 0.006) - height, height - 0.006];
      force = [0, 0, stiffness * (Math.max(0, below) - Math.max(0, above))];
      if (i * DT > 2) late = Math.max(late, norm(force));
    }
    expect(late).toBeLessThan(0.15);
  });

  it("goes back to the cursor when it is left alone", () => {
    let state = restAt([0, 0, CLEAR]);
    for (let i = 0; i < 20; i += 1) state = follow(state, DEFAULT_HAND, [0, 0, CLEAR], false, [0, 0, 1], DT);
    const aside = state.tip.position[2];
    for (let i = 0; i < 2000; i += 1) state = follow(state, DEFAULT_HAND, [0, 0, CLEAR], false, ZERO, DT);
    expect(aside).toBeGreaterThan(CLEAR);
    expect(state.tip.position[2]).toBeCloseTo(CLEAR, 5);
    expect(state.floor).toBeNull();
  });

  it("goes elsewhere without waiting", () => {
    let state = follow(restAt([0, 0, 0]), DEFAULT_HAND, [0, 0, 0], false, [0, 0, 1], DT);
    for (let i = 0; i < 400; i += 1) state = follow(state, DEFAULT_HAND, [0.1, 0, -0.02], false, ZERO, DT);
    expect(state.tip.position[2]).toBeLessThan(-0.015);
  });

  it("presses again at once when it is told to", () => {
    let state = follow(restAt([0, 0, 0]), DEFAULT_HAND, [0, 0, 0], false, [0, 0, 1], DT);
    expect(state.floor).not.toBeNull();
    const [, , before] = state.intended;
    state = follow(state, DEFAULT_HAND, [0, 0, -0.01], true, ZERO, DT);
    expect(state.floor).toBeNull();
    expect(state.intended[2]).toBeLessThan(before);
  });
});
