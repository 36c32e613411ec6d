import { expect, it } from "vitest";
import campaign from "../../../src/control/campaign_rooms.json";
import { neighbours, type RoomFacts } from "../../../src/control/neighbours";
import { MOST_HANDS, neighbourWords, wordsOf } from "../../../src/ui/cards/neighbour_words";

const facts: RoomFacts = { rule: "predictive", hands: 2, delay: 100, coupling: 28, lag: 34 };
const found = { rooms: 500, like: 12, stable: 12, swing: 0, error: 4, nearest: null };
const rest = (words: string): string => words.slice(words.indexOf("). ") + 3);

it("how many there were, how near they are, and the worst", () => {
  expect(wordsOf(facts, found)).toBe(
    "12 of the campaign\u2019s 500 runs with 2 hands under the predictive law are like this room"
    + " (loop 100 ms \u00b1 25, coupling 0.28 \u00b1 0.10, lag 34 ms \u00b1 20). All 12 were stable; the worst: a steady force was 0.4 % off.");
  expect(rest(wordsOf(facts, { ...found, error: 0 }))).toBe("All 12 were stable; the worst: no steady force was off by 0.1 %.");
  expect(rest(wordsOf(facts, { ...found, stable: 9, swing: 61 }))).toBe("9 of 12 were stable. The worst: a force that swings by 61 % of the largest.");
  expect(rest(wordsOf(facts, { ...found, stable: 0, swing: 61 }))).toBe("All 12 were unstable. The worst: a force that swings by 61 % of the largest.");
  expect(rest(wordsOf(facts, { ...found, like: 1, stable: 1 }))).toBe("It was stable; the worst: a steady force was 0.4 % off.");
  expect(rest(wordsOf(facts, { ...found, like: 1, stable: 0, swing: 7 }))).toBe("It was unstable. The worst: a force that swings by 7 % of the largest.");
});

it("no neighbours are said to be none, with the nearest or the reason", () => {
  const none = { ...found, like: 0, stable: 0, nearest: { delay: 310, coupling: 120, lag: 9 } };
  expect(wordsOf({ ...facts, hands: 1 }, none)).toContain("No neighbours: none of the campaign\u2019s 500 runs with one hand under the predictive law is like this room");
  expect(wordsOf(facts, none)).toContain("The nearest has a loop of 310 ms, coupling 1.20 and a lag of 9 ms.");
  expect(neighbourWords({ ...facts, delay: 9000 })).toContain("No neighbours: none of");
  expect(neighbourWords("friction")).toBe("No neighbours: its fingers have no friction.");
});

it("the table is whole: as many rooms under each rule as it says, six numbers each", () => {
  expect(MOST_HANDS).toBe(8);
  expect(campaign.columns).toEqual(["delay", "coupling", "lag", "unstable", "swing", "error"]);
  for (const [rule, hands] of Object.entries(campaign.outcomes)) {
    for (const numbers of hands) expect(numbers.length % campaign.columns.length).toBe(0);
    const variants = campaign.variants[rule as keyof typeof campaign.variants];
    expect(hands.flat().length, rule).toBe(campaign.columns.length * variants * campaign.rooms);
  }
});

it("the default object's two hands have neighbours, and the paper's rule has unstable ones", () => {
  // As the page showed it of two hands at opposite sides of the balloon, on one machine.
  expect(neighbours(campaign.outcomes, { ...facts, delay: 217, coupling: 69, lag: 34 }).like).toBeGreaterThan(3);
  const paper = neighbours(campaign.outcomes, { rule: "alone", hands: 4, delay: 210, coupling: 160, lag: 0 });
  expect(paper.stable).toBeLessThan(paper.like);
});
