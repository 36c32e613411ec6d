import { expect, test } from "vitest";
import { decodeWhy, WhyAsker } from "../../src/session/why";

const WHY = { t: 1, force: 2, sentence: "The hand was given 2.00 N.", entries: [{ name: "surface", newtons: 2, words: "the spring" }, { name: "rate", newtons: null, words: "the limit" }] };
const settled = async (): Promise<void> => { for (let i = 0; i < 20; i += 1) await Promise.resolve(); };

test("a ledger is read, also one without a number, and none", () => {
  expect(decodeWhy(JSON.stringify(WHY))).toEqual({ sentence: WHY.sentence, entries: WHY.entries });
  expect(decodeWhy("null\n")).toBeNull();
  for (const wrong of ["[]", "{}", JSON.stringify({ ...WHY, entries: [1] }), JSON.stringify({ ...WHY, entries: [{ name: "a", words: "b", newtons: "2" }] })]) {
    expect(() => decodeWhy(wrong), wrong).toThrow();
  }
});

test("it is asked for each hand and time once, at most some times a second, and for the last one in any case", async () => {
  const asked: [number, number][] = [];
  const asker = new WhyAsker((user, t) => {
    asked.push([user, t]);
    return Promise.resolve(JSON.stringify(WHY));
  });
  for (let k = 0; k < 100; k += 1) {
    asker.ask(1, 100 + Math.min(k, 60) / 10, k / 10);
    await settled();
  }
  expect(asked.length).toBeLessThan(20);
  expect(asked.at(-1)).toEqual([1, 106]);
  expect(asker.answer?.sentence).toBe(WHY.sentence);
  asker.ask(2, 106, 20);
  expect(asked.at(-1)).toEqual([2, 106]);
});

test("it says why there is no answer", async () => {
  let answer: () => Promise<string> = () => Promise.resolve("null");
  const asker = new WhyAsker(() => answer());
  asker.ask(1, 100, 0);
  await settled();
  expect([asker.answer, asker.words]).toEqual([null, "The file has no rows of this hand from this time: its client sent none."]);
  answer = () => Promise.reject(new Error("the file is gone"));
  asker.ask(1, 101, 1);
  await settled();
  expect(asker.words).toBe("The answer does not come: the file is gone");
  asker.ask(null, 102, 2);
  expect(asker.words).toBe("Nobody is here at this time.");
});
