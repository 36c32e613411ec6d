import { expect, test } from "vitest";
import { LEAST_GAP, PAD_SILENCE, PAGE_SILENCE } from "../../src/gamepad/link";
import { Bench } from "./stand_in";

const HARD = { start: 90, resistance: 200, rumble: 40 };
const NONE = { resistance: 0, rumble: 0 };

test("what is to be felt goes out when it changes, and no more often than the pad bears", async () => {
  const bench = new Bench();
  let k = 0;
  await bench.pass(1, () => {
    bench.device.say(80);
    k += 1;
    bench.link.give({ ...HARD, resistance: k % 256 });
  });
  const times = bench.device.told.map(({ t }) => t);
  const gaps = times.slice(1).map((t, i) => t - (times[i] ?? 0));
  expect(Math.min(...gaps)).toBeGreaterThanOrEqual(LEAST_GAP - 1e-9);
  expect(times.length).toBeGreaterThan(80);
  const before = bench.device.told.length;
  await bench.pass(1, () => {
    bench.device.say(80);
    bench.link.give(HARD);
  });
  expect(bench.device.told.length).toBeLessThanOrEqual(before + 1);
});

test("a page that gives nothing any more lets go", async () => {
  const bench = new Bench();
  await bench.pass(0.1, () => { bench.device.say(80); bench.link.give(HARD); });
  expect(bench.device.has).toEqual({ resistance: 200, rumble: 40 });
  await bench.pass(PAGE_SILENCE + 2 * LEAST_GAP, () => { bench.device.say(80); });
  expect(bench.device.has).toEqual(NONE);
});

test("a pad that tells nothing any more is let go", async () => {
  const bench = new Bench();
  await bench.pass(0.1, () => { bench.device.say(80); bench.link.give(HARD); });
  await bench.pass(PAD_SILENCE + 2 * LEAST_GAP, () => { bench.link.give(HARD); });
  expect(bench.device.has).toEqual(NONE);
  expect(bench.link.trouble).toBe("");
});

test("a page that goes to sleep lets go at once", async () => {
  const bench = new Bench();
  await bench.pass(0.1, () => { bench.device.say(80); bench.link.give(HARD); });
  bench.link.still();
  expect(bench.device.has).toEqual(NONE);
});

test("unplugged, whether the browser says so or a report fails", async () => {
  for (const says of [true, false]) {
    const bench = new Bench();
    await bench.pass(0.1, () => { bench.device.say(80); bench.link.give(HARD); });
    bench.device.there = false;
    if (says) bench.link.disconnected();
    await bench.pass(0.05, () => { bench.device.say(80); bench.link.give({ ...HARD, rumble: 0 }); });
    expect(bench.link.trouble).toBe("The gamepad was unplugged.");
    await bench.link.close();
    await bench.link.close();
  }
});

test("a pad that takes nothing is told, and one that sends something else, too", async () => {
  const deaf = new Bench();
  deaf.device.answers = false;
  await deaf.pass(0.4, () => { deaf.device.say(80); deaf.link.give(HARD); });
  expect(deaf.link.trouble).toContain("takes no reports");
  expect(deaf.device.told.length).toBe(1);
  const foreign = new Bench();
  await foreign.pass(0.2, () => { foreign.device.speak(0x31, new Uint8Array(77)); foreign.link.give(HARD); });
  expect(foreign.link.trouble).toContain("Bluetooth is not supported");
  expect(foreign.device.has).toEqual(NONE);
});

test("any bytes are heard without a word, and some of them are no report", async () => {
  const bench = new Bench();
  let seed = 1;
  const random = (): number => (seed = (seed * 48271) % 2147483647);
  await bench.pass(0.5, () => {
    bench.device.speak(random() % 3, Uint8Array.from({ length: random() % 3 === 0 ? 63 : random() % 80 }, () => random() % 256));
    const held = bench.link.poll();
    if (held !== null) for (const share of [...held.left, ...held.right]) expect(Math.abs(share)).toBeLessThanOrEqual(1);
  });
});

test("at the end everything is off, twice, and the pad is released", async () => {
  const bench = new Bench();
  await bench.pass(0.1, () => { bench.device.say(80); bench.link.give(HARD); });
  const before = bench.device.told.length;
  await bench.link.close();
  expect(bench.device.told.length).toBe(before + 2);
  expect(bench.device.has).toEqual(NONE);
  expect(bench.device.opened).toBe(false);
  await bench.pass(0.1);
  expect(bench.device.told.length).toBe(before + 2);
});
