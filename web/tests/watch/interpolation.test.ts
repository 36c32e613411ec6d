import { describe, expect, test } from "vitest";
import { between, type Frame, place, usersBetween } from "../../src/watch/interpolation";
import { record } from "./scenes";

const rest = Float32Array.from([1, 2, 3]);

function frame(t_server: number, x: number, users = [1]): Frame {
  const room = { lag: x, coupling: 0, margin: 2 };
  return { t_server, room, users: users.map((user) => record(user, x)), displacement: Float32Array.from([x, 0, 0]) };
}

const frames = [frame(1, 0), frame(1.1, 0.1), frame(1.2, 0.3)];

/** First coordinate of the surface at a time. */
function shown(t: number, all: readonly Frame[] = frames, longest = 1): number {
  const found = between(all, t, longest);
  if (found === null) return NaN;
  const positions = new Float32Array(3);
  place(positions, rest, found);
  return (positions[0] ?? NaN) - 1;
}

describe("between frames", () => {
  test("the surface goes straight from one to the next", () => {
    expect(shown(1)).toBeCloseTo(0, 6);
    expect(shown(1.05)).toBeCloseTo(0.05, 6);
    expect(shown(1.15)).toBeCloseTo(0.2, 6);
    expect(shown(1.2)).toBeCloseTo(0.3, 6);
  });

  test("before the first and after the last it stands still", () => {
    expect(shown(0)).toBeCloseTo(0, 6);
    expect(shown(9)).toBeCloseTo(0.3, 6);
    expect(between([], 1, 1)).toBeNull();
  });

  test("a frame holds until shortly before the next: the server sends none while nothing changes", () => {
    const sparse = [frame(1, 0), frame(5, 0.4)];
    expect(shown(4.85, sparse, 0.1)).toBeCloseTo(0, 6);
    expect(shown(4.95, sparse, 0.1)).toBeCloseTo(0.2, 6);
  });

  test("it is continuous in time", () => {
    let before = shown(0.9);
    for (let t = 0.9; t < 1.4; t += 0.001) {
      expect(Math.abs(shown(t) - before)).toBeLessThan(0.0025);
      before = shown(t);
    }
  });
});

describe("users between frames", () => {
  test("move straight on", () => {
    const found = between(frames, 1.05, 1);
    const [user] = found === null ? [] : usersBetween(found);
    expect(user?.probe[0]).toBeCloseTo(0.05, 6);
    expect(user?.normal).toEqual([1, 0, 0]);
  });

  test("come and go at the time of the second", () => {
    const change = [frame(1, 0, [1, 2]), frame(2, 0, [2, 3])];
    const who = (t: number): number[] => {
      const found = between(change, t, 1);
      return found === null ? [] : usersBetween(found).map(({ user }) => user);
    };
    expect(who(1.9)).toEqual([1, 2]);
    expect(who(2)).toEqual([2, 3]);
  });
});
