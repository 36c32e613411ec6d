import { describe, expect, test } from "vitest";
import { FrameRing } from "../../src/watch/frame_ring";

/** Numbers from 0 to 1, the same in every run. */
function chance(seed: number): () => number {
  let x = seed;
  return () => {
    x = (x * 1664525 + 1013904223) % 2 ** 32;
    return x / 2 ** 32;
  };
}

const frameOf = (n: number, length: number): Uint8Array => Uint8Array.from({ length }, (_, k) => (7 * n + k) % 251);

describe("the frames of the last minute", () => {
  test("are the newest ones, unharmed, in order and within every bound, whatever comes", () => {
    for (let seed = 1; seed <= 20; seed += 1) {
      const next = chance(seed);
      const [bytes, most, seconds] = [40 + Math.floor(200 * next()), 1 + Math.floor(20 * next()), 1 + 9 * next()];
      const ring = new FrameRing(bytes, most, seconds);
      const pushed: { t: number; frame: Uint8Array }[] = [];
      let t = 100;
      for (let n = 0; n < 200; n += 1) {
        t += 0.01 + next() ** 4;
        const frame = frameOf(n, Math.floor(0.5 * bytes * next()));
        pushed.push({ t, frame });
        ring.push(t, frame);
        if (n % 7 !== 0) continue;
        const kept = ring.take();
        const last = pushed.slice(pushed.length - kept.times.length);
        expect([...kept.times]).toEqual(last.map((one) => one.t));
        expect(kept.frames).toEqual(last.map((one) => one.frame));
        expect(kept.times.length).toBeGreaterThan(0);
        expect(kept.times.length).toBeLessThanOrEqual(most);
        expect(ring.span).toBeLessThanOrEqual(seconds);
        expect(kept.frames.reduce((sum, one) => sum + one.length, 0)).toBeLessThanOrEqual(bytes);
      }
    }
  });

  test("are a minute of a room of sixteen hands, with place for more", () => {
    const ring = new FrameRing();
    const frame = new Uint8Array(28 + 16 * 84);
    for (let n = 0; n < 5000; n += 1) ring.push(n / 30, frame);
    expect(ring.span).toBeGreaterThan(59.9);
    expect(ring.span).toBeLessThanOrEqual(60);
  });

  test("of a server that began anew are no more than its own", () => {
    const ring = new FrameRing(100, 10, 60);
    for (const t of [500, 501, 502]) ring.push(t, frameOf(t, 5));
    ring.push(3, frameOf(3, 5));
    expect([...ring.take().times]).toEqual([3]);
  });

  test("stay as they were taken while the ring goes on, and one that is too large is left out", () => {
    const ring = new FrameRing(10, 10, 60);
    ring.push(1, frameOf(1, 8));
    const taken = ring.take();
    ring.push(2, frameOf(2, 11));
    ring.push(3, frameOf(3, 9));
    expect(taken.frames).toEqual([frameOf(1, 8)]);
    expect([...ring.take().times]).toEqual([3]);
    ring.clear();
    expect(ring.take().frames).toEqual([]);
    expect(ring.span).toBe(0);
  });
});
