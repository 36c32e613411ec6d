import { describe, expect, test } from "vitest";
import { spectralRadius } from "../../src/control/eigenvalues";
import { integralIsStable, liftedRadius, proportionalIsStable } from "../../src/control/stability";
import { closedEdge, liftedEdge, stabilityArea } from "../../src/control/stability_area";
import { expectClose } from "../close";
import { vectors } from "../vectors";

interface StabilityVectors {
  radii: {
    k_h: number;
    step_gain: number | null;
    k_o: number;
    b_o: number;
    rate_ratio: number;
    delay_samples: number;
    radius: number;
  }[];
  edges: { k_h: number; k_o: number; delay: number; lifted: number[] | null; closed: number[] | null }[];
}

const { radii, edges } = vectors("stability") as StabilityVectors;

describe("as the Python side", () => {
  test.each(radii)("radius at K_h $k_h, T I $step_gain, N $rate_ratio, delay $delay_samples, B_o $b_o", (v) => {
    expectClose(liftedRadius(v, v, v.rate_ratio, v.delay_samples), v.radius, "radius");
  });

  // Where the loop's eigenvalues meet, on the edge, half of the digits of a radius are lost.
  test.each(edges)("edges at K_h $k_h, $delay periods late", ({ k_h, k_o, delay, lifted, closed }) => {
    expectClose(liftedEdge(k_h, { k_o, b_o: 0 }, 1, delay), lifted, "lifted", 1e-6, 1e-6);
    expectClose(closedEdge(k_h, { k_o, b_o: 0 }), closed, "closed");
  });
});

describe("the closed conditions and the lifted system", () => {
  const body = { k_o: 100, b_o: 15 };

  test("agree on the proportional model, on either side of its edge", () => {
    for (const k_h of [129.9, 130.1]) {
      expect(liftedRadius({ k_h, step_gain: null }, body, 16, 0) < 1).toBe(proportionalIsStable(k_h, body));
    }
  });

  test("agree on the integral model, on either side of its edges", () => {
    for (const k_h of [20, 120, 200]) {
      const [low, high] = closedEdge(k_h, body) ?? [NaN, NaN];
      for (const i_n_t of [low - 0.1, low + 0.1, high - 0.1, high + 0.1]) {
        if (i_n_t <= 0) continue;
        const radius = liftedRadius({ k_h, step_gain: i_n_t / 16 }, body, 16, 0);
        expect(radius < 1, `${k_h} ${i_n_t}`).toBe(integralIsStable(k_h, i_n_t, body));
      }
    }
  });
});

test("the area is a polygon without holes that delay makes smaller", () => {
  const widest = (delay: number): number =>
    Math.max(0, ...stabilityArea({ k_o: 100, b_o: 0 }, delay, 21).map(([, i_n_t]) => i_n_t));
  expect(stabilityArea({ k_o: 100, b_o: 0 }, 0, 21).length).toBeGreaterThan(20);
  expect(widest(1)).toBeLessThan(widest(0));
  expect(widest(6)).toBeLessThan(widest(1));
});

describe("the spectral radius", () => {
  test("of matrices whose eigenvalues are known", () => {
    expect(spectralRadius([])).toBe(0);
    expect(spectralRadius([[-3]])).toBe(3);
    expect(spectralRadius([[0, 1], [-1, 0]])).toBeCloseTo(1, 14);
    expect(spectralRadius([[2, 1, 0], [0, 2, 1], [0, 0, -5]])).toBeCloseTo(5, 12);
    // A permutation, on which plain QR goes round in circles.
    expect(spectralRadius([[0, 0, 0, 16], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]])).toBeCloseTo(2, 12);
  });

  test("is that of the transpose, and grows with the matrix", () => {
    let seed = 1;
    const next = (): number => (seed = (seed * 16807) % 2147483647) / 2147483647 - 0.5;
    for (let n = 3; n < 24; n += 4) {
      const a = Array.from({ length: n }, () => Array.from({ length: n }, next));
      const t = a.map((_, i) => a.map((row) => row[i] ?? 0));
      const r = spectralRadius(a);
      expect(spectralRadius(t)).toBeCloseTo(r, 8);
      expect(spectralRadius(a.map((row) => row.map((x) => 3 * x)))).toBeCloseTo(3 * r, 8);
    }
  });
});
