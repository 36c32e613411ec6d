import { describe, expect, it } from "vitest";
import type { UserState } from "../../../src/model/scene";
import { sample } from "../../../src/ui/cards/user_card";
import { proxyOf } from "../../../src/view/pose";
import { user } from "../../users";

describe("the sample of a user", () => {
  it("is probe and proxy below the resting surface", () => {
    const pressed: UserState = { ...user(1), foot: [0.1, 0, 0], normal: [1, 0, 0], probe: [0.085, 0, 0], x_free: [0.097, 0, 0], force: [3, 0, 0], c_ii: 0.004 };
    const [probe, proxy, force] = sample(pressed);
    expect(probe).toBeCloseTo(0.015, 9);
    expect(proxy).toBeCloseTo(0.003 + 0.012, 9);
    expect(force).toBe(3);
  });

  it("of a finger that sticks has the tip on the surface, or above it as far as the device is soft", () => {
    const stuck: UserState = {
      ...user(1), law: "predictive", friction: true, probe: [0.085, 0.006, 0], x_free: [0.097, 0, 0], force: [2, 1, 0], c_ii: 0.004, k_h: 250,
    };
    expect(sample(stuck).slice(0, 2)).toEqual([expect.closeTo(0.015, 9), expect.closeTo(0.015, 9)]);
    expect(proxyOf(stuck)).toEqual(stuck.probe);
    expect(sample({ ...stuck, k_h: 125 })[1]).toBeCloseTo(0.015 - 0.008, 9);
  });

  it("has no proxy in the air", () => {
    const above: UserState = { ...user(1), probe: [0.12, 0, 0], x_free: [0.1, 0, 0], force: [0, 0, 0] };
    expect(sample(above)[1]).toBeNaN();
  });
});
