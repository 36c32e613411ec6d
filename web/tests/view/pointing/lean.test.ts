import { describe, expect, it } from "vitest";
import { dot, norm, sub, unit, type Vec3 } from "../../../src/model/vec";
import { leaning, leanOff, MOST, OBLIQUE, type Sight, turned } from "../../../src/view/pointing/lean";

const PIVOT: Vec3 = [0, -0.1, 0];
const NORMAL: Vec3 = [0, -1, 0];
const RIGHT: Vec3 = [1, 0, 0];
const WIDE: Sight = { eye: [0, -0.54, 0], right: RIGHT, aspect: 1.6 };
const TALL: Sight = { ...WIDE, aspect: 0.5 };
const anywhere = (): boolean => true;
const off = (eye: Vec3): number => Math.acos(dot(unit(sub(eye, PIVOT)), NORMAL));

describe("the camera off the normal", () => {
  it("sees the pressed place from beside, as far away as before", () => {
    for (const sight of [WIDE, TALL]) {
      const lean = leanOff(PIVOT, NORMAL, sight, anywhere);
      if (lean === null) throw new Error("no lean");
      const there = turned(sight.eye, lean, RIGHT);
      expect(off(there)).toBeCloseTo(MOST, 6);
      expect(norm(sub(there, PIVOT))).toBeCloseTo(norm(sub(sight.eye, PIVOT)), 9);
      expect(turned(PIVOT, lean, RIGHT)).toEqual(PIVOT);
    }
  });

  it("goes to the side in a wide picture and up in a tall one, so that the body stays in it", () => {
    expect(leanOff(PIVOT, NORMAL, WIDE, anywhere)?.way).toBe("beside");
    const up = leanOff(PIVOT, NORMAL, TALL, anywhere);
    if (up === null) throw new Error("no lean");
    expect(up.way).toBe("above");
    expect(turned(TALL.eye, up, RIGHT)[2]).toBeGreaterThan(0.1);
  });

  it("goes on to the side from which it comes, and only as far as a dent needs", () => {
    for (const side of [0.2, -0.2]) {
      const eye: Vec3 = [side, -0.5, 0];
      const lean = leanOff(PIVOT, NORMAL, { ...WIDE, eye }, anywhere);
      if (lean === null) throw new Error("no lean");
      const there = turned(eye, lean, RIGHT);
      expect(Math.sign(there[0])).toBe(Math.sign(side));
      expect(off(there)).toBeCloseTo(OBLIQUE, 6);
    }
  });

  it("stays where the place is seen from beside already", () => {
    expect(leanOff(PIVOT, NORMAL, { ...WIDE, eye: [0.5, -0.5, 0] }, anywhere)).toBeNull();
  });

  it("goes where the pressed place is not hidden, and nowhere where it is from all sides", () => {
    expect(leanOff(PIVOT, NORMAL, WIDE, (eye) => eye[2] > 0.1)?.way).toBe("above");
    expect(leanOff(PIVOT, NORMAL, WIDE, () => false)).toBeNull();
  });

  it("never goes over the top, where the vertical is no axis", () => {
    const steep: Vec3 = [0, -0.3, 0.42];
    const lean = leanOff(PIVOT, unit(sub(steep, PIVOT)), { ...TALL, eye: steep }, anywhere);
    expect(lean?.way ?? "beside").toBe("beside");
  });
});

it("a turn comes to its end exactly, so that drawing can stop", () => {
  let at = 0;
  for (let i = 0; i < 120; i++) at = leaning(at, MOST, 1 / 60);
  expect(at).toBe(MOST);
  for (let i = 0; i < 120; i++) at = leaning(at, 0, 1 / 60);
  expect(at).toBe(0);
});
