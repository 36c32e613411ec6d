import { describe, expect, test } from "vitest";
import { firstFrame, frameInterval, nextFrame, playoutDelay, type PlayoutClock } from "../../src/watch/playout_clock";

const INTERVAL = 1 / 30;
const AHEAD = 1000; // server's clock less the page's [s]

/** A stream whose frames take `way(i)` to come. */
function stream(frames: number, way: (i: number) => number, each?: (t: PlayoutClock, now: number, i: number) => void): PlayoutClock {
  let clock: PlayoutClock | null = null;
  for (let i = 0; i < frames; i += 1) {
    const sent = i * INTERVAL;
    const now = sent + way(i);
    clock =
      clock === null
        ? firstFrame(sent + AHEAD, now, INTERVAL)
        : nextFrame(clock, sent + AHEAD, now, INTERVAL);
    each?.(clock, now, i);
  }
  if (clock === null) throw new Error("no frames");
  return clock;
}

describe("the time that is shown", () => {
  test("stays one interval behind an even stream, whatever its delay", () => {
    for (const delay of [0.001, 0.3]) {
      const clock = stream(300, () => delay);
      expect(playoutDelay(clock)).toBeCloseTo(INTERVAL + 0.003, 6);
    }
  });

  test("leaves room for jitter: frames come before they are needed", () => {
    let late = 0;
    const jitter = (i: number): number => 0.02 + 0.03 * Math.abs(Math.sin(i * 1.7));
    stream(600, jitter, (clock, now, i) => {
      // The frame before this one is done when shown time passes it.
      const shown = now - clock.lag;
      if (i > 200 && shown > (i - 1) * INTERVAL + AHEAD + 1e-9) late += 1;
    });
    expect(late).toBe(0);
  });

  test("forgets a bad time after some seconds", () => {
    const clock = stream(900, (i) => (i > 100 && i < 110 ? 0.3 : 0.02));
    expect(playoutDelay(clock)).toBeCloseTo(INTERVAL + 0.003, 3);
  });

  test("forgets the page's own start", () => {
    const clock = stream(200, (i) => (i < 10 ? 0.4 : 0.02));
    expect(playoutDelay(clock)).toBeCloseTo(INTERVAL + 0.003, 3);
  });

  test("forgets frames before a pause", () => {
    const busy = stream(100, (i) => (i % 2 ? 0.3 : 0.02));
    const after = nextFrame(busy, 60 + AHEAD, 60.02, INTERVAL);
    expect(playoutDelay(after)).toBeCloseTo(INTERVAL + 0.003, 3);
  });

  test("never runs backwards, nor more than a tenth too fast or too slow", () => {
    let before = NaN;
    let at = NaN;
    stream(900, (i) => 0.02 + (i % 97 === 0 ? 0.015 : 0), (clock, now) => {
      const shown = now - clock.lag;
      if (now > at + 1e-3) {
        const pace = (shown - before) / (now - at);
        expect(pace).toBeGreaterThan(0.899);
        expect(pace).toBeLessThan(1.101);
      }
      [before, at] = [shown, now];
    });
  });

  test("follows clocks that drift", () => {
    // A hundredth of a second in ten: no pair of clocks is that bad.
    const clock = stream(900, (i) => 0.02 + 1e-3 * i * INTERVAL);
    expect(playoutDelay(clock)).toBeLessThan(0.06);
  });
});

test("frames come after ticks only", () => {
  expect(frameInterval(30, 1 / 60)).toBeCloseTo(1 / 30, 12);
  expect(frameInterval(60, 1 / 60)).toBeCloseTo(1 / 60, 12);
  expect(frameInterval(25, 1 / 60)).toBeCloseTo(3 / 60, 12);
  expect(frameInterval(60, 1 / 20)).toBeCloseTo(1 / 20, 12);
});
