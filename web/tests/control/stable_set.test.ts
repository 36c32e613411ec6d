import { describe, expect, it, test } from "vitest";
import { isStable, isStable15, rootsInside, stableEdges, stableOutline } from "../../src/control/stable_set";
import { vectors } from "../vectors";

/** By how much a disturbance of the delayed loop grows in one period, in the long run. */
function growthOf(kappa: number, int: number, delay: number): number {
  let x = Array.from({ length: delay + 2 }, (_, i) => Math.cos(i));
  let logarithm = 0;
  const periods = 4000;
  for (let n = 0; n < 2 * periods; n++) {
    const next = (x[delay + 1] ?? 0) - kappa * (x[1] ?? 0) + (kappa - int) * (x[0] ?? 0);
    x = [...x.slice(1), next];
    const size = Math.max(...x.map(Math.abs));
    if (size === 0) return 0;
    x = x.map((value) => value / size);
    if (n >= periods) logarithm += Math.log(size);
  }
  return Math.exp(logarithm / periods);
}

interface StabilityVectors {
  readonly radii: readonly {
    readonly k_h: number;
    readonly step_gain: number | null;
    readonly k_o: number;
    readonly b_o: number;
    readonly rate_ratio: number;
    readonly delay_samples: number;
    readonly radius: number;
  }[];
  readonly edges: readonly { readonly k_h: number; readonly k_o: number; readonly delay: number; readonly lifted: readonly number[] | null }[];
}

const { radii, edges } = vectors("stability") as StabilityVectors;

/** The figure is of an undamped body, with one haptic period in a simulation period and delay in whole ones. */
const figure = radii.filter(({ b_o, rate_ratio }) => b_o === 0 && rate_ratio === 1);

describe("the stable set as the Python side has it", () => {
  test("is compared at enough gains", () => {
    expect(figure.length).toBeGreaterThanOrEqual(18);
    expect(edges.filter(({ lifted }) => lifted !== null).length).toBeGreaterThanOrEqual(10);
  });

  test.each(figure)("at K_h $k_h, T I $step_gain, $delay_samples periods late", ({ k_h, step_gain, k_o, delay_samples, radius }) => {
    expect(isStable({ kappa: k_h / k_o, int: (step_gain ?? 0) / k_o }, delay_samples)).toBe(radius < 1);
  });

  test.each(edges)("from edge to edge at K_h $k_h, $delay periods late", ({ k_h, k_o, delay, lifted }) => {
    const found = stableEdges(k_h / k_o, delay);
    if (lifted === null || found === null) {
      expect(found).toBe(lifted);
      return;
    }
    const [low = Number.NaN, high = Number.NaN] = lifted;
    expect(found[0] * k_o).toBeCloseTo(low, 3);
    expect(found[1] * k_o).toBeCloseTo(high, 3);
    const at = (i_n_t: number): boolean => isStable({ kappa: k_h / k_o, int: i_n_t / k_o }, delay);
    expect([at(low + 0.01), at(high - 0.01), at(high + 0.01)]).toEqual([true, true, false]);
    if (low > 0) expect(at(low - 0.01)).toBe(false);
  });
});

describe("the stable set", () => {
  it("of polynomials is where the roots are", () => {
    // (z - a)(z - b)
    const quadratic = (a: number, b: number): number[] => [1, -(a + b), a * b];
    expect(rootsInside(quadratic(0.9, -0.5))).toBe(true);
    expect(rootsInside(quadratic(1.01, 0.2))).toBe(false);
    expect(rootsInside(quadratic(0.3, -1.2))).toBe(false);
    expect(rootsInside([1, 0, 0.98])).toBe(true);
    expect(rootsInside([1, 0, 1.02])).toBe(false);
  });

  it("without delay is eq. (15)", () => {
    for (let kappa = 0.05; kappa < 3.2; kappa += 0.1) {
      for (let int = 0.05; int < 4.2; int += 0.1) {
        const edge = Math.min(Math.abs(Math.abs(int - kappa) - 1), Math.abs(int - 2 * kappa + 2));
        if (edge > 1e-6) expect(isStable({ kappa, int }, 0)).toBe(isStable15({ kappa, int }));
      }
    }
  });

  it("with delay is where the loop settles, period by period", () => {
    for (const delay of [1, 2, 4, 9]) {
      for (const kappa of [0.1, 0.5, 0.9]) {
        for (const int of [0.02, 0.1, 0.3, 0.8, 1.4]) {
          const growth = growthOf(kappa, int, delay);
          if (Math.abs(growth - 1) > 1e-3) expect(isStable({ kappa, int }, delay)).toBe(growth < 1);
        }
      }
    }
  });

  it("of the proportional law is K_h < K_o at any delay, eq. (8)", () => {
    for (const delay of [0, 3, 40]) {
      expect(isStable({ kappa: 0.99, int: 0 }, delay)).toBe(true);
      expect(isStable({ kappa: 1.01, int: 0 }, delay)).toBe(false);
    }
  });

  it("has an outline that shrinks with delay", () => {
    const height = (d: number): number => Math.max(...stableOutline(d, 20).map(([, int]) => int));
    expect(height(0)).toBeGreaterThan(3.9);
    expect(height(1)).toBeGreaterThan(height(4));
    expect(height(4)).toBeGreaterThan(height(16));
    expect(height(16)).toBeGreaterThan(0);
  });
});
