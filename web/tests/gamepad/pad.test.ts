import { expect, test } from "vitest";
import { type Felt, GIVE_UP, Pad } from "../../src/gamepad/pad";
import { norm, sub, type Vec3 } from "../../src/model/vec";
import { Bench } from "./stand_in";

const BODY = { center: [0, 0, 0.1], radius: 0.05 } as const;
const FRAME = 0.015; // s: three looks

class Play {
  readonly bench = new Bench();
  readonly pad = new Pad(this.bench.link, BODY, [0, -1, 0]);
  target: Vec3 = this.pad.out;
  hand: Felt | null = { force: [0, 0, 0], t: 0, live: true, fault: "" };
  speaks = true;
  readonly steps: number[] = [];

  /** Frames with a trigger that is held so, and the force of a spring as the object. */
  async hold(pull: number, seconds: number): Promise<void> {
    for (let t = 0; t < seconds; t += FRAME) {
      await this.bench.pass(FRAME, () => { if (this.speaks) this.bench.device.say(pull); });
      const depth = Math.max(0, this.target[1] + BODY.radius);
      if (this.hand !== null) this.hand = { ...this.hand, force: [0, -300 * depth, 0], t: this.bench.now };
      const next = this.pad.step(this.bench.now, this.hand);
      this.steps.push(norm(sub(next, this.target)));
      this.target = next;
    }
    await this.bench.pass(FRAME, () => { if (this.speaks) this.bench.device.say(pull); });
  }
}

test("the trigger presses, the object resists, and letting go lifts the hand off", async () => {
  const play = new Play();
  await play.hold(0, 0.1);
  expect(play.target).toEqual([0, -1.1 * BODY.radius, 0.1]);
  expect(play.bench.device.has.resistance).toBe(0);
  await play.hold(255, 1);
  expect(play.target[1]).toBeCloseTo(-0.5 * BODY.radius, 6);
  expect(play.bench.device.has.resistance).toBeGreaterThan(200);
  await play.hold(0, 1);
  expect(play.target[1]).toBeLessThan(-BODY.radius);
  expect(play.bench.device.has.resistance).toBe(0);
  expect(Math.max(...play.steps)).toBeLessThanOrEqual((0.5 + 0.15) * 0.02); // trigger and stick, in the longest frame that counts
});

test("a trigger that was held before the beginning, or through a pause, does not press", async () => {
  const play = new Play();
  await play.hold(255, 0.5);
  expect(play.target).toEqual(play.pad.out);
  await play.hold(0, 0.1);
  await play.hold(255, 0.5);
  play.pad.pause();
  expect(play.bench.device.has).toEqual({ resistance: 0, rumble: 0 });
  await play.hold(255, 1);
  expect(play.target[1]).toBeLessThan(-BODY.radius);
});

test.each([
  ["a fault", { fault: "too fast" }],
  ["a server that is silent", { live: false }],
])("%s switches everything off and takes the hand out", async (_, change) => {
  const play = new Play();
  await play.hold(0, 0.1);
  await play.hold(255, 0.5);
  if (play.hand !== null) play.hand = { ...play.hand, ...change };
  await play.hold(255, 1);
  expect(play.bench.device.has).toEqual({ resistance: 0, rumble: 0 });
  expect(play.target[1]).toBeLessThan(-BODY.radius);
  if (play.hand !== null) play.hand = { ...play.hand, live: true, fault: "" };
  await play.hold(255, 0.5); // still held: it presses only once it was let go
  expect(play.bench.device.has.resistance).toBe(0);
});

test("a hand that is not in the room, or whose Worker has stopped, feels nothing", async () => {
  const play = new Play();
  await play.hold(0, 0.1);
  await play.hold(255, 0.5);
  play.hand = null;
  await play.hold(255, 0.1);
  expect(play.bench.device.has).toEqual({ resistance: 0, rumble: 0 });
  const { force } = { force: [0, -3, 0] as const };
  const stale = { force, t: play.bench.now, live: true, fault: "" };
  for (let k = 0; k < 20; k += 1) {
    await play.bench.pass(FRAME, () => { play.bench.device.say(0); });
    play.pad.step(play.bench.now, stale);
  }
  expect(play.bench.device.has).toEqual({ resistance: 0, rumble: 0 });
});

test("a pad that falls silent in contact is let go, and then gone", async () => {
  const play = new Play();
  await play.hold(0, 0.1);
  await play.hold(255, 0.5);
  play.speaks = false;
  await play.hold(255, 0.12);
  expect(play.bench.device.has).toEqual({ resistance: 0, rumble: 0 });
  expect(play.pad.trouble).toBe("");
  await play.hold(255, GIVE_UP);
  expect(play.pad.trouble).toContain("has gone silent");
});
