import { expect, test } from "vitest";
import { felt, NOTHING_FELT } from "../../src/gamepad/feeling";
import type { Effects } from "../../src/gamepad/reports";
import type { Vec3 } from "../../src/model/vec";
import { vectors } from "../vectors";

const { feelings } = vectors("gamepad") as {
  readonly feelings: {
    readonly inward: Vec3;
    readonly full: number;
    readonly rows: readonly { readonly force: Vec3; readonly pull: number; readonly now: number; readonly effects: Effects }[];
  };
};

test("what is felt of a force is what Python has felt", () => {
  let feeling = NOTHING_FELT;
  for (const { force, pull, now, effects } of feelings.rows) {
    feeling = felt(feeling, force, pull, feelings.inward, feelings.full, now);
    expect(feeling.effects).toEqual(effects);
  }
});

test("a force that is no number is none, and does not stay", () => {
  const once = felt(NOTHING_FELT, [NaN, -1, 0], 100, [0, 1, 0], 3, 0);
  expect(once.effects).toEqual({ start: 0, resistance: 0, rumble: 0 });
  expect(felt(once, [0, -1, 0], 100, [0, 1, 0], 3, 1).slow.every(Number.isFinite)).toBe(true);
});
