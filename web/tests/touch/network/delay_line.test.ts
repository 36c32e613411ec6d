import { expect, test } from "vitest";
import { CAPACITY, DelayLine, LONGEST, type Message } from "../../../src/touch/network/delay_line";

const state = (n: number): Message => Uint8Array.of(n);

test("without a delay a message passes at once, with one when it is due", () => {
  const line = new DelayLine();
  line.push("now", 1);
  expect(line.take(1)).toEqual(["now"]);
  line.delay = 0.25;
  line.push("later", 1);
  expect(line.take(1.2)).toEqual([]);
  expect(line.take(1.25)).toEqual(["later"]);
});

test("nothing overtakes where the delay becomes shorter", () => {
  const line = new DelayLine();
  line.delay = 0.5;
  line.push("first", 0);
  line.delay = 0;
  line.push("second", 0.125);
  expect(line.take(0.25)).toEqual([]);
  expect(line.take(0.5)).toEqual(["first", "second"]);
  line.push("third", 0.625);
  expect(line.take(0.625)).toEqual(["third"]);
});

test("of states that leave together the newest counts, in its place among the events", () => {
  const line = new DelayLine();
  const all = [state(1), "a", state(2), "b", state(3), "c"];
  for (const data of all) line.push(data, 0);
  expect(line.take(0)).toEqual(["a", "b", state(3), "c"]);
});

test("holds no message for longer than it may, and never sends one to the past", () => {
  const line = new DelayLine();
  line.delay = 60;
  line.push("far", 0);
  expect(line.take(LONGEST)).toEqual(["far"]);
  line.delay = -1;
  line.push("near", 2);
  expect(line.take(2)).toEqual(["near"]);
});

test("of more than there is room for the first leave early: no event is lost", () => {
  const line = new DelayLine();
  line.delay = 1;
  const out: Message[] = [];
  for (let i = 0; i < 3 * CAPACITY; i += 1) {
    line.push(`${i}`, 0);
    out.push(...line.take(0));
  }
  expect(out.length).toBe(2 * CAPACITY);
  expect([...out, ...line.take(1)]).toEqual(Array.from({ length: 3 * CAPACITY }, (_, i) => `${i}`));
});
