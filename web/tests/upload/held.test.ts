import { describe, expect, test } from "vitest";
import { type Box, boxOf, layerEnd, layerOf, layerRule, Painting } from "../../src/upload/held";

const BOX: Box = { low: [-0.1, -0.05, 0], high: [0.1, 0.05, 0.3] };

test("the box holds every vertex and no more", () => {
  const box = boxOf(new Float32Array([0, 1, 2, -1, 5, 0, 3, 2, 1]));
  expect(box).toEqual({ low: [-1, 1, 0], high: [3, 5, 2] });
});

describe("a layer", () => {
  test.each([
    ["z < 5%", { axis: 2, sign: -1, share: 5 }],
    ["x > 90%", { axis: 0, sign: 1, share: 10 }],
    ["y < 30%", { axis: 1, sign: -1, share: 30 }],
  ] as const)("of the server's rule %s is that, and makes it again", (rule, layer) => {
    expect(layerOf(rule)).toEqual(layer);
    expect(layerRule(layer)).toBe(rule);
  });

  test.each(["z < 5cm", "z < 5% or x > 3%", "", "w < 5%", "z < 500%"])("is not meant by %s", (rule) => {
    expect(layerOf(rule)).toBeNull();
  });

  test("ends where its share ends", () => {
    expect(layerEnd({ axis: 2, sign: -1, share: 10 }, BOX)).toBeCloseTo(0.03);
    expect(layerEnd({ axis: 2, sign: 1, share: 10 }, BOX)).toBeCloseTo(0.27);
  });
});

/** Whether a rule holds a point, by its words alone. */
function holds(rule: string, point: readonly number[]): boolean {
  return rule.split(" or ").some((box) =>
    box.split(" and ").every((condition) => {
      const found = /^([xyz])([<>])(-?[\d.e-]+)$/.exec(condition);
      if (found === null) throw new Error(condition);
      const x = point["xyz".indexOf(found[1] ?? "")] ?? NaN;
      return found[2] === "<" ? x < Number(found[3]) : x > Number(found[3]);
    }));
}

describe("a painting", () => {
  test("has cells all over the object", () => {
    const { origin, counts, cell } = new Painting(BOX);
    for (const k of [0, 1, 2] as const) {
      expect(origin[k]).toBeLessThan(BOX.low[k]);
      expect(origin[k] + counts[k] * cell).toBeGreaterThan(BOX.high[k]);
    }
  });

  test("of nothing has no rule", () => {
    const painting = new Painting(BOX);
    expect(painting.empty).toBe(true);
    expect(painting.rule()).toBe("");
  });

  test("becomes boxes that hold its cells, each once, and nothing else", () => {
    const painting = new Painting(BOX);
    for (let i = 0; i < 12; i++) painting.paint([0.1 * Math.cos(i), 0.05 * Math.sin(2 * i), 0.01 * i]);
    const rule = painting.rule() ?? "";
    const boxes = painting.boxes();
    const [nx, ny, nz] = painting.counts;
    for (let z = 0; z < nz; z++) {
      for (let y = 0; y < ny; y++) {
        for (let x = 0; x < nx; x++) {
          const middle = [x, y, z].map((i, k) => (painting.origin[k] ?? 0) + (i + 0.5) * painting.cell);
          const inside = boxes.filter(({ low, high }) => middle.every((v, k) => v > (low[k] ?? 0) && v < (high[k] ?? 0)));
          const painted = painting.cells[x + nx * (y + ny * z)] === 255;
          expect(inside.length).toBe(painted ? 1 : 0);
          expect(holds(rule, middle)).toBe(painted);
        }
      }
    }
  });

  test("far from the origin of its file holds the same cells, at any size", () => {
    const [larger, middle] = [100, [5e5, -12, 0.25]] as const;
    const painting = new Painting(BOX);
    painting.paint([0.1, 0.05, 0.3]);
    const [here, there] = [painting.rule() ?? "", painting.rule(larger, middle) ?? ""];
    for (let i = 0; i < 300; i++) {
      const point = [0.1 + 0.04 * Math.cos(i), 0.05 + 0.04 * Math.cos(2 * i), 0.3 + 0.04 * Math.cos(3 * i)];
      expect(holds(there, point.map((x, k) => larger * (x + (middle[k] ?? 0))))).toBe(holds(here, point));
    }
  });

  test("holds the point that was painted, and is gone when it is cleared", () => {
    const painting = new Painting(BOX);
    expect(painting.paint([0.1, 0.05, 0.3])).toBe(true);
    expect(painting.paint([0.1, 0.05, 0.3])).toBe(false);
    expect(holds(painting.rule() ?? "", [0.0999, 0.0499, 0.2999])).toBe(true);
    painting.clear();
    expect(painting.empty).toBe(true);
  });

  test("in more pieces than a rule has place for has none", () => {
    const painting = new Painting(BOX);
    for (let i = 0; i < painting.cells.length; i += 5) painting.cells[i] = 255;
    expect(painting.rule()).toBeNull();
  });
});
