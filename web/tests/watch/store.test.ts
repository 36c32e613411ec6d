import { describe, expect, test } from "vitest";
import { Browser } from "./browser";
import { record, sceneFrame, WATCHING } from "./scenes";

describe("a surface", () => {
  test("shows a surface that stays where it is through signs of life without one", () => {
    for (const encoding of ["frames", "forces"] as const) {
      const browser = new Browser(encoding);
      browser.join();
      browser.line.frame(sceneFrame(5, 100, [record(1)], 100));
      expect(browser.watch.at(browser.time + 1)?.positions[0]).toBeCloseTo(0.101, 6);
      for (let i = 1; i < 10; i += 1) {
        browser.time += 0.5;
        browser.line.frame(sceneFrame(5 + i, 100 + 0.5 * i, [record(1)], null));
        const view = browser.watch.at(browser.time);
        expect(view?.positions[0]).toBeCloseTo(0.101, 6);
        expect(view?.moved).toBe(false);
      }
    }
  });
});

describe("a surface from forces", () => {
  test("is had in frames until the blocks are here", async () => {
    const browser = new Browser("forces");
    browser.join();
    browser.line.frame(sceneFrame(1, 100, [record(1)], null));
    expect(browser.fetched[0]).toBe(`http://127.0.0.1:8765/room/v1/models/${WATCHING.model}/green/0,2,3`);
    browser.watch.at(browser.time);
    expect(browser.line.acks).toEqual([{ tick: 1, wants: 1 }]);
    expect(browser.watch.status.encoding).toBe("frames");
    browser.line.frame(sceneFrame(2, 100.01, [record(1)], -100));
    expect(browser.watch.at(browser.time + 1)?.positions[0]).toBeCloseTo(0.099, 6);
    await browser.answer();
    browser.line.frame(sceneFrame(3, 100.02, [record(1)], null));
    // 1 N on the hand is 1 N into the body, a millimetre per newton.
    expect(browser.watch.at(browser.time + 2)?.positions[0]).toBeCloseTo(0.099, 6);
    expect(browser.line.acks.at(-1)).toEqual({ tick: 3, wants: 0 });
    expect(browser.watch.status).toMatchObject({ encoding: "forces", blocks_missing: 0 });
  });

  test("is shown as soon as the blocks come, without another frame", async () => {
    const browser = new Browser("forces");
    browser.join();
    browser.line.frame(sceneFrame(1, 100, [record(1)], null));
    expect(browser.watch.at(browser.time + 1)?.positions[0]).toBeCloseTo(0.1, 6);
    await browser.answer();
    const view = browser.watch.at(browser.time + 1);
    expect(view?.positions[0]).toBeCloseTo(0.099, 6);
    expect(view?.moved).toBe(true);
  });

  test("is in frames for ever where the body has no model", () => {
    const browser = new Browser("forces");
    browser.join({ ...WATCHING, model: null });
    browser.line.frame(sceneFrame(1, 100, [record(1)], -100));
    browser.watch.at(browser.time);
    expect(browser.fetched).toEqual([]);
    expect(browser.line.acks).toEqual([{ tick: 1, wants: 0 }]);
    expect(browser.watch.status.encoding).toBe("frames");
  });
});
