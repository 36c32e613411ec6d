import { describe, expect, it } from "vitest";
import { arranged, beside, type Place } from "../../src/view/labels";

describe("a name", () => {
  const tip = { x: 100, y: 100 };

  it("begins where the stem ends, whichever way it points", () => {
    expect(beside(tip, { x: 200, y: 100 }, 40)).toEqual({ x: 240, y: 100 });
    expect(beside(tip, { x: 0, y: 100 }, 40)).toEqual({ x: -40, y: 100 });
    expect(beside(tip, { x: 100, y: 0 }, 40).y).toBeLessThan(-10);
  });

  it("leaves a hand in sight whose stem points at the eye", () => {
    expect(beside(tip, { x: 104, y: 96 }, 40).y).toBeLessThan(60);
  });
});

describe("names", () => {
  const at = (x: number, y: number, off: number | null = 0): Place => ({ x, y, half: 50, off });
  const overlaps = (places: readonly Place[], offs: readonly (number | null)[]): number => {
    const seen = places.flatMap((place, i) => (offs[i] === null || offs[i] === undefined ? [] : [{ ...place, y: place.y + offs[i] }]));
    let found = 0;
    seen.forEach((a, i) => { for (const b of seen.slice(i + 1)) found += Number(Math.abs(a.x - b.x) < 100 && Math.abs(a.y - b.y) < 24); });
    return found;
  };

  it("that have room stay where they are", () => {
    expect(arranged([at(60, 100), at(200, 100), at(60, 140)], 0, 500)).toEqual([0, 0, 0]);
  });

  it("never lie on one another, nor outside, however many there are", () => {
    const places = Array.from({ length: 16 }, (_, i) => at(150 + 17 * (i % 5), 120 + 11 * (i % 7)));
    const offs = arranged(places, 60, 300);
    expect(overlaps(places, offs)).toBe(0);
    expect(offs[0]).toBe(0); // who chooses first is never moved
    expect(offs.filter((off) => off !== null).length).toBeGreaterThan(5);
    places.forEach(({ y }, i) => {
      const off = offs[i];
      if (off === null || off === undefined) return;
      expect(y + off).toBeGreaterThanOrEqual(60);
      expect(y + off).toBeLessThanOrEqual(300);
    });
  });

  it("do not jump to and fro where another one moves by a pixel", () => {
    const first = arranged([at(100, 100), at(100, 123)], 0, 500);
    expect(first[1]).not.toBe(0);
    const own = first[1] ?? 0;
    for (const y of [124, 125, 123, 126]) expect(arranged([at(100, 100), at(100, y, own)], 0, 500)[1]).toBe(own);
    expect(arranged([at(100, 100), at(100, 140, own)], 0, 500)[1]).toBe(0);
  });
});
