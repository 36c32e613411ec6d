/** The rehearsal against what is known in closed form of two held hands. */

import { describe, expect, it } from "vitest";
import { PAPER } from "../../src/model/laws";
import { type Pair, rehearse } from "../../src/tour/rehearsal";
import { RESTS, SWINGS, swingOf } from "../../src/tour/swing";

const C = 1 / 280;

function pair(share: number, delay = 0.24, depth = 0.015): Pair {
  const hand = { c: C, delay, depth };
  return { hands: [hand, hand], coupling: share * C, period: 1 / 60 };
}

function lastOf(times: readonly number[], forces: readonly number[]): ReturnType<typeof swingOf> {
  const from = times.findIndex((t) => t > (times.at(-1) ?? 0) - 4);
  return swingOf(times.slice(from), forces.slice(from));
}

function swing(given: Pair, law: "paper" | "predictive"): { size: number; hz: number } {
  const { times, forces } = rehearse(given, law, 40);
  return lastOf(times, forces) ?? { size: NaN, hz: NaN };
}

describe("two hands without a lag", () => {
  it("swing with the rule for one as soon as K (C_ii + |C_ij|) > 1, at half the rate of the delay", () => {
    for (const share of [-0.65, -0.2, 0.2, 0.65]) {
      const { size, hz } = swing(pair(share), "paper");
      expect(size).toBeGreaterThan(SWINGS);
      // f(t) = -g f(t - T) comes back after 2 T; T in whole ticks.
      expect(hz).toBeCloseTo(1 / (2 * 14.4 / 60), 0);
    }
  });

  it("swing at an odd multiple of that rate where one loop is a tick or two longer than the other", () => {
    for (const longer of [1, 2]) {
      for (const share of [-0.65, 0.65]) {
        const [T, tick] = [14 / 60, 1 / 60];
        const [one, other] = pair(share, T).hands;
        const given = { ...pair(share, T), hands: [one, { ...other, delay: T + longer * tick }] as const };
        const { size, hz } = swing(given, "paper");
        expect(size).toBeGreaterThan(SWINGS);
        const multiple = hz * 2 * (T + 0.5 * longer * tick);
        expect(Math.abs(multiple - (2 * Math.floor(0.5 * multiple) + 1))).toBeLessThan(0.35);
      }
    }
  });

  it("come to rest where the two do not couple, or weakly", () => {
    const { size } = swing(pair(0), "paper");
    const early = rehearse(pair(0), "paper", 8);
    expect(size).toBeLessThan(0.5 * (lastOf(early.times, early.forces)?.size ?? 0));
    expect(PAPER * (1 + 0.01)).toBeLessThan(1);
    expect(swing(pair(0.01), "paper").size).toBeLessThan(swing(pair(0.2), "paper").size);
  });

  it("rest with the predictive law at any delay, at the force of both in one room", () => {
    for (const delay of [0, 0.05, 0.24, 0.6]) {
      for (const share of [-0.65, 0.3, 0.65]) {
        const given = pair(share, delay);
        expect(swing(given, "predictive").size).toBeLessThan(RESTS);
        // f = D / (C + C_12) for both
        expect(rehearse(given, "predictive", 40).forces.at(-1)).toBeCloseTo(Math.min(10, 0.015 / (C * (1 + share))), 2);
      }
    }
  });

  it("are no wonder for impossible numbers", () => {
    const { forces } = rehearse(pair(3), "paper", 20);
    expect(forces.every((f) => f >= 0 && f <= 10)).toBe(true);
    expect(rehearse(pair(0.5), "paper", 0).forces).toEqual([]);
  });
});
