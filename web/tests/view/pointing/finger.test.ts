import { describe, expect, it } from "vitest";
import { along, norm, sub, turn, unit, type Vec3 } from "../../../src/model/vec";
import { deeper, DEPTH, follow, goal, hover, penDepth, type Place3, press, release, slide } from "../../../src/view/pointing/finger";

const R = 0.1;
const SIDE: Place3 = { surface: [R, 0, 0], normal: [1, 0, 0], point: [R - 0.004, 0, 0] };
const DT = 1 / 60;

describe("a press", () => {
  it("begins at the surface as it is, and goes in to its depth", () => {
    const finger = press(SIDE, 10);
    expect(goal(finger, 10, R)[0]).toBeCloseTo(R - 0.004, 9);
    expect(goal(finger, 99, R)[0]).toBeCloseTo(R - 0.004 - DEPTH.usual * R, 9);
  });

  it("never comes back while it is held", () => {
    const finger = press(SIDE, 0);
    let before = Infinity;
    for (let t = 0; t < 3; t += 0.05) {
      const x = goal(finger, t, R)[0];
      expect(x).toBeLessThanOrEqual(before);
      before = x;
    }
  });

  it("slides without a jump in depth: its hold on the surface stays", () => {
    const to: Place3 = { surface: [0, R, 0], normal: [0, 1, 0], point: [0, R - 0.03, 0] };
    const slid = slide(press(SIDE, 0), to);
    expect(slid.offset).toBeCloseTo(-0.004, 9);
    expect(slid.surface).toEqual(to.surface);
  });

  it("lets go to in front of the surface", () => {
    const x = goal(release(press(SIDE, 0)), 5, R)[0];
    expect(x).toBeGreaterThan(R - 0.004);
    expect(goal(hover(SIDE), 5, R)[0]).toBeCloseTo(x, 9);
  });

  it("has limits of depth", () => {
    expect(deeper(press(SIDE, 0), 9).depth).toBe(DEPTH.most);
    expect(deeper(press(SIDE, 0), -9).depth).toBe(DEPTH.least);
  });

  it("of a pen is as deep as its pressure", () => {
    expect(penDepth(0.5)).toBeCloseTo(0.5 * DEPTH.pen, 9);
    expect(penDepth(0)).toBe(DEPTH.least);
    expect(penDepth(7)).toBe(DEPTH.pen);
  });
});

describe("the tip", () => {
  const center: Vec3 = [0, 0, 0];

  it("goes round the body to its other side, never through", () => {
    let tip: Vec3 = [-1.08 * R, 0, 0];
    const to: Vec3 = [1.08 * R, 0, 0];
    for (let i = 0; i < 300; i++) {
      tip = follow(tip, to, center, R, DT);
      expect(norm(tip)).toBeGreaterThan(1.05 * R);
    }
    expect(norm(sub(tip, to))).toBeLessThan(1e-4);
  });

  it("comes out before it goes round, if it was inside", () => {
    let tip: Vec3 = [-0.8 * R, 0, 0];
    const heights: number[] = [];
    for (let i = 0; i < 60; i++) {
      tip = follow(tip, [1.08 * R, 0, 0], center, R, DT);
      if (tip[0] > 0) heights.push(norm(tip));
    }
    expect(Math.min(...heights)).toBeGreaterThan(1.05 * R);
  });

  it("arrives from wherever it is", () => {
    // At the height of the way round, rounding puts many a tip just below it.
    for (let k = 0; k < 500; k++) {
      const middle: Vec3 = [0.01 * Math.sin(k), 0, 0.02 * Math.cos(3 * k)];
      const away: Vec3 = [Math.cos(k), Math.sin(k), Math.sin(7 * k)];
      let tip = along(middle, (1 + 0.0007 * k) * R, unit(away));
      const to = along(middle, -0.9 * R, unit(away));
      for (let i = 0; i < 200; i++) tip = follow(tip, to, middle, R, DT);
      expect(norm(sub(tip, to)), `start ${String(k)}`).toBeLessThan(1e-4);
    }
  });

  it("is never faster than a hand", () => {
    let tip: Vec3 = [R, 0, 0];
    const to: Vec3 = [0.9 * R, 0.3 * R, 0];
    for (let i = 0; i < 60; i++) {
      const next = follow(tip, to, center, R, DT);
      expect(norm(sub(next, tip)) / DT).toBeLessThan(2.6 * R);
      tip = next;
    }
    expect(norm(sub(tip, to))).toBeLessThan(1e-4);
  });

  it("turns about any axis where two directions are opposite", () => {
    const d = turn([0, 0, 1], [0, 0, -1], 0.1);
    expect(norm(d)).toBeCloseTo(1, 9);
    expect(d[2]).toBeCloseTo(Math.cos(0.1), 9);
  });
});
