import { expect, test } from "vitest";
import { axesOf, cursorAt, moved, placeOf, pullOf } from "../../src/gamepad/cursor";
import { cross, dot, norm, type Vec3 } from "../../src/model/vec";
import { vectors } from "../vectors";

interface Row {
  readonly left: readonly [number, number];
  readonly right: readonly [number, number];
  readonly pull: number;
  readonly contact: boolean;
  readonly place: Vec3;
  readonly pull_of: number;
}

const { moves } = vectors("gamepad") as {
  readonly moves: { readonly depth: number; readonly reach: number; readonly dt: number; readonly rows: readonly Row[] };
};

test("the tip goes where Python's goes", () => {
  const axes = axesOf([0, -1, 0]);
  let cursor = cursorAt(-0.11);
  for (const { left, right, pull, contact, place, pull_of } of moves.rows) {
    cursor = moved(cursor, { left, right, pull, buttons: 0 }, moves.dt, moves, contact);
    placeOf(cursor, axes).forEach((x, k) => { expect(x).toBeCloseTo(place[k] ?? NaN, 10); });
    expect(pullOf(cursor, moves)).toBe(pull_of);
  }
});

test("whoever lets go of the trigger has let go of the object", () => {
  let cursor = { ...cursorAt(-0.02), press: 0.02 };
  const held = { left: [0, 0], right: [0, 1], pull: 0, buttons: 0 } as const;
  for (let k = 0; k < 200; k += 1) cursor = moved(cursor, held, 0.016, moves, cursor.base + cursor.press > -0.05);
  expect(cursor.base + cursor.press).toBeLessThanOrEqual(-0.05 + 0.15 * 0.016);
});

test("axes are at right angles, whichever way one looks", () => {
  for (const eye of [[0, -1, 0], [1, 1, 0.5], [0, 0, 1], [0, 0, -1], [0, 0, 0]] as const) {
    const { side, up, inward } = axesOf(eye);
    for (const axis of [side, up, inward]) expect(norm(axis)).toBeCloseTo(1, 12);
    expect(dot(side, inward)).toBeCloseTo(0, 12);
    cross(side, inward).forEach((x, k) => { expect(x).toBeCloseTo(up[k] ?? NaN, 12); });
  }
  axesOf([0, -1, 0]).side.forEach((x, k) => { expect(x).toBeCloseTo([1, 0, 0][k] ?? NaN, 12); });
});
