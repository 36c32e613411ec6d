import { describe, expect, it } from "vitest";
import { SleepDetector } from "../../src/page/sleep_detector";

describe("pauses", () => {
  it("are noticed by the gap they leave, once the page has begun", () => {
    const w = new SleepDetector();
    let now = 0;
    w.frame(now);
    expect(w.frame((now += 9))).toBe(0);
    for (let i = 0; i < 20; i++) expect(w.frame((now += 0.016))).toBe(0);
    expect(w.frame((now += 60))).toBeCloseTo(60, 6);
    expect(w.told(now + 1)).toBeCloseTo(60, 6);
    expect(w.told(now + 60)).toBe(0);
  });

  it("of a slow machine are none, of the same length in the background they are", () => {
    const w = new SleepDetector();
    let now = 0;
    for (let i = 0; i < 20; i++) w.frame((now += 0.016));
    expect(w.frame((now += 6))).toBe(0);
    w.hide();
    expect(w.frame((now += 6))).toBeCloseTo(6, 6);
    expect(w.frame((now += 6))).toBe(0);
  });
});
