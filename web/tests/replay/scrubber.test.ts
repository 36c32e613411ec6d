import { describe, expect, test } from "vitest";
import { advance, begin, lastBefore, moment, pace, play, seek, type Scrubber, SPEEDS, step } from "../../src/replay/scrubber";

const TIMES = Float64Array.from([100, 100.5, 101, 103]);
const there = (s: Scrubber): boolean => s.t >= s.from && s.t <= s.to;

describe("a scrubber", () => {
  test("begins at the end, still, and plays from the beginning then", () => {
    const s = begin(TIMES);
    expect(s).toEqual({ t: 103, from: 100, to: 103, speed: 1, playing: false });
    expect(advance(s, 1)).toEqual(s);
    expect(play(s, true)).toMatchObject({ t: 100, playing: true });
  });

  test("runs at a tenth of life's pace where that is chosen, and stands at its end", () => {
    let s = pace(play(begin(TIMES), true), 0.1);
    for (let i = 0; i < 100; i += 1) s = advance(s, 0.1);
    expect(s.t).toBeCloseTo(101, 9);
    for (let i = 0; i < 300; i += 1) s = advance(s, 0.1);
    expect(s).toMatchObject({ t: 103, playing: false });
  });

  test("goes on by little after a page that slept", () => {
    const s = play(begin(TIMES), true);
    expect(advance(s, 60).t).toBe(100.25);
    expect(advance(s, -1).t).toBe(100);
  });

  test("goes frame by frame, from between two to the nearer side, and no further than the ends", () => {
    let s = seek(begin(TIMES), 100.7);
    expect(step(s, TIMES, 1).t).toBe(101);
    expect(step(s, TIMES, -1).t).toBe(100.5);
    s = step(step(s, TIMES, -1), TIMES, -1);
    expect(s.t).toBe(100);
    expect(step(s, TIMES, -1).t).toBe(100);
    expect(step(play(s, true), TIMES, 1)).toMatchObject({ t: 100.5, playing: false });
    expect(step(begin(TIMES), TIMES, 1).t).toBe(103);
  });

  test("stays within the recording whatever is done, and knows one frame as well as none", () => {
    for (const times of [TIMES, Float64Array.of(7), Float64Array.of()]) {
      let s = begin(times);
      const acts: ((s: Scrubber) => Scrubber)[] = [
        (x) => seek(x, -1e9), (x) => play(x, true), (x) => advance(x, 1e9), (x) => step(x, times, 1), (x) => seek(x, Infinity),
        (x) => seek(x, NaN), (x) => step(x, times, -1), (x) => pace(x, SPEEDS[1]), (x) => advance(x, NaN), (x) => seek(x, 101.2),
      ];
      for (let i = 0; i < 300; i += 1) {
        s = acts[(i * 7 + (i % 11)) % acts.length]?.(s) ?? s;
        expect(there(s), `${i}`).toBe(true);
      }
    }
  });
});

test("the last time that is not after another is found", () => {
  for (let t = 99; t < 105; t += 0.25) {
    expect(lastBefore(TIMES, t)).toBe([...TIMES].filter((x) => x <= t).length - 1);
  }
});

test("moments are reached one after another; while it plays, a step back does not stay at the one that was just passed", () => {
  const moments = [{ t: 100.2 }, { t: 101 }, { t: 102 }];
  let s = seek(begin(TIMES), 0);
  const seen: number[] = [];
  for (let to = moment(s, moments, 1); to !== null; to = moment(s, moments, 1)) seen.push((s = seek(s, to.t)).t);
  expect(seen).toEqual([100.2, 101, 102]);
  expect(moment(s, moments, -1)?.t).toBe(101);
  expect(moment(seek(s, 101.3), moments, -1)?.t).toBe(101);
  expect(moment(play(seek(s, 101.3), true), moments, -1)?.t).toBe(100.2);
  expect(moment(seek(s, 100.2), moments, -1)).toBeNull();
});
