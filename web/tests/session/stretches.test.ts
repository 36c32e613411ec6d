import { describe, expect, test } from "vitest";
import { decodeStretch, type FetchScenes, LENGTH, MOST_BYTES, Stretches } from "../../src/session/stretches";
import { record, sceneFrame } from "../watch/scenes";

/** The server's response: scenes with the time up to which they are complete. */
function body(until: number, frames: readonly Uint8Array[]): ArrayBuffer {
  const made = new Uint8Array(8 + frames.reduce((sum, { length }) => sum + 4 + length, 0));
  const view = new DataView(made.buffer);
  view.setFloat64(0, until, true);
  let at = 8;
  for (const frame of frames) {
    view.setUint32(at, frame.length, true);
    made.set(frame, at + 4);
    at += 4 + frame.length;
  }
  return made.buffer;
}

const scene = (t: number, units: number | null = null): Uint8Array => sceneFrame(1 + Math.round(10 * t), t, [record(1)], units);

/** A session of ten scenes a second, whose server gives a second of them at most. */
const server = (asked: [number, number][], shortest = Infinity): FetchScenes => (from, to) => {
  asked.push([from, to]);
  const until = Math.min(to, from + shortest);
  const frames: Uint8Array[] = [];
  for (let k = Math.ceil(10 * from - 1e-9); k / 10 < until - 1e-9; k += 1) frames.push(scene(k / 10));
  return Promise.resolve(body(until, frames));
};

const settled = async (): Promise<void> => { for (let i = 0; i < 200; i += 1) await Promise.resolve(); };

describe("a response", () => {
  test("has its scenes in order, without damaged ones and without those of a time before", () => {
    const bad = scene(2);
    bad[1] = 99;
    const [scenes, until] = decodeStretch(body(5, [scene(1), bad, scene(3), scene(2.5), scene(4)]));
    expect([...scenes.times]).toEqual([1, 3, 4]);
    expect(scenes.frames[1]).toEqual(scene(3));
    expect([scenes.surfaces, until]).toEqual([false, 5]);
    expect(decodeStretch(body(5, [scene(1), scene(2, 10)]))[0].surfaces).toBe(true);
  });

  test("that is cut is refused, and not read beyond its end", () => {
    const whole = body(5, [scene(1), scene(2)]);
    for (const length of [0, 7, 10, 40, whole.byteLength - 1]) {
      expect(() => decodeStretch(whole.slice(0, length)), `${length}`).toThrow(/length of a/);
    }
    const wild = whole.slice(0);
    new DataView(wild).setUint32(8, 0xffffffff, true);
    expect(() => decodeStretch(wild)).toThrow("length of a scene");
  });
});

describe("the stretches of a session", () => {
  test("come round the shown time, each once, and join without a gap", async () => {
    const asked: [number, number][] = [];
    let now = 0;
    const stretches = new Stretches(100, 200, server(asked), () => now);
    expect([stretches.has(141), stretches.round(141).times.length]).toEqual([false, 0]);
    for (now of [0, 0.1, 0.2]) { // after a jump the others wait for the surface of the moment
      stretches.want(141, 1);
      await settled();
      expect(asked.map(([from]) => from)).toEqual([140]);
    }
    now = 0.5;
    stretches.want(141, 1);
    await settled();
    expect(asked.map(([from]) => from)).toEqual([140, 144, 136]);
    expect(stretches.has(141)).toBe(true);
    const round = stretches.round(141);
    expect([round.times[0], round.times.at(-1), round.times.length]).toEqual([136, 147.9, 10 * 3 * LENGTH]);
    expect(round.frames.length).toBe(round.times.length);
    expect(stretches.round(142)).toBe(round);
    stretches.want(142, 1);
    await settled();
    expect(asked.length).toBe(3);
  });

  test("are fetched farther ahead where time goes fast, and not beyond the ends", async () => {
    const asked: [number, number][] = [];
    const stretches = new Stretches(100, 200, server(asked), () => 0);
    stretches.want(101, 10);
    await settled();
    expect(asked.map(([from]) => from)).toEqual([100, 104, 108, 112]);
    stretches.want(1e9, 10);
    await settled();
    expect(stretches.has(200)).toBe(true);
    expect(Math.max(...asked.map(([from]) => from))).toBe(200);
  });

  test("that the server gives in parts are asked for until they are whole", async () => {
    const asked: [number, number][] = [];
    const stretches = new Stretches(100, 104, server(asked, 1.5), () => 0);
    stretches.want(100, 1);
    await settled();
    expect(asked.slice(0, 3).map(([from]) => from)).toEqual([100, 104, 101.5]);
    expect([stretches.trouble, stretches.round(100).times.length]).toEqual(["", 10 * 2 * LENGTH]);
  });

  test("do not grow however long a session is, and keep what is near", async () => {
    const stretches = new Stretches(0, 4000, server([]), () => 0);
    for (let t = 0; t < 400; t += 2) {
      stretches.want(t, 1);
      await settled();
      expect(stretches.size).toBeLessThanOrEqual(12);
      expect(stretches.bytes).toBeLessThanOrEqual(MOST_BYTES);
      expect(stretches.has(t)).toBe(true);
    }
    expect(stretches.has(0)).toBe(false);
  });

  test("that do not come are asked for again after a second, with the reason meanwhile", async () => {
    let [now, works, calls] = [0, false, 0];
    const fetch = server([]);
    const stretches = new Stretches(0, 3, (from, to) => {
      calls += 1;
      return works ? fetch(from, to) : Promise.reject(new Error("the disk is gone"));
    }, () => now);
    for (let i = 0; i < 5; i += 1) {
      stretches.want(1, 1);
      await settled();
    }
    expect([calls, stretches.has(1)]).toEqual([1, false]);
    expect(stretches.trouble).toBe("the scenes do not come: the disk is gone");
    [now, works] = [1.1, true];
    stretches.want(1, 1);
    await settled();
    expect([stretches.has(1), stretches.trouble]).toEqual([true, ""]);
  });

  test("that end before they begin are refused, and asked for no endless time", async () => {
    let calls = 0;
    const stretches = new Stretches(0, 3, (from) => {
      calls += 1;
      return Promise.resolve(body(from, []));
    }, () => 0);
    stretches.want(1, 1);
    await settled();
    expect(calls).toBe(1);
    expect(stretches.trouble).toContain("end of a stretch");
  });
});
