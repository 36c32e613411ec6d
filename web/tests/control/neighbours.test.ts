import { describe, expect, it } from "vitest";
import { neighbours, reach, roomFacts, type RoomFacts, sameRoom, type Table } from "../../src/control/neighbours";
import type { UserState } from "../../src/model/scene";
import { user } from "../users";

const ROOM = { lag: 0.034, coupling: 0.28, margin: 3 };
const hand = (change: Partial<UserState> = {}): UserState => ({ ...user(1), law: "predictive", c_ii: 1 / 250, k_h: 250, loop_delay: 0.1, ...change });
const facts: RoomFacts = { rule: "predictive", hands: 2, delay: 100, coupling: 28, lag: 34 };
const table = (...rows: (readonly number[])[]): Table => ({ predictive: [[], rows.flat()], pi: [], proportional: [], alone: [] });

describe("what a room is looked up by", () => {
  it("is in whole numbers, of the longest loop", () => {
    expect(roomFacts([hand(), hand({ loop_delay: 0.0504 })], ROOM, 8)).toEqual(facts);
  });

  it("is nothing without a hand at the object", () => {
    expect(roomFacts([], ROOM, 8)).toBeNull();
    expect(roomFacts([hand({ c_ii: 0, k_h: 0 })], ROOM, 8)).toBeNull();
  });

  it("knows the server's gains from the paper's rule and from somebody's own", () => {
    const paper = { law: "proportional", c_ii: 1 / 250, k_o_coupled: 140 } as const;
    const ruleOf = (change: Partial<UserState>): unknown => {
      const found = roomFacts([hand({ ...paper, ...change })], ROOM, 8);
      return found !== null && typeof found === "object" ? found.rule : found;
    };
    expect(ruleOf({ k_h: 0.9 * 140 })).toBe("proportional");
    expect(ruleOf({ k_h: 0.98 * 250 })).toBe("alone");
    expect(ruleOf({ law: "pi", k_h: 0.3 * 140 })).toBe("pi");
    for (const own of [{ k_h: 40 }, { k_h: 1.2 * 250 }, { law: "pi", k_h: 0.9 * 140 } as const]) expect(ruleOf(own)).toBe("own gains");
  });

  it("says why the campaign has none like it", () => {
    expect(roomFacts(Array.from({ length: 9 }, () => hand()), ROOM, 8)).toBe("too many");
    expect(roomFacts([hand(), hand({ friction: true })], ROOM, 8)).toBe("friction");
    expect(roomFacts([hand(), hand({ law: "pi", k_h: 42 })], ROOM, 8)).toBe("mixed laws");
    expect(roomFacts([hand(), hand({ k_h: 200 })], ROOM, 8)).toBe("soft device");
  });
});

describe("rooms of the campaign", () => {
  it("count where loop, coupling and lag are all within reach, its edge included", () => {
    expect([reach("delay", 100), reach("coupling", 28), reach("lag", 34)]).toEqual([25, 10, 20]);
    const inside = [[125, 38, 54], [75, 18, 14], [100, 28, 34]];
    const outside = [[126, 28, 34], [100, 39, 34], [100, 28, 55]];
    const found = neighbours(table(...[...inside, ...outside].map((row) => [...row, 0, 0, 0])), facts);
    expect(found).toMatchObject({ rooms: 6, like: 3, stable: 3, nearest: { delay: 100, coupling: 28, lag: 34 } });
  });

  it("have a worst one: the largest swing of the unstable, the largest error of the stable", () => {
    const near = [100, 28, 34];
    const found = neighbours(table([...near, 0, 4, 7], [...near, 1, 61, 900], [...near, 1, 22, 10], [300, 28, 34, 1, 99, 99]), facts);
    expect(found).toMatchObject({ like: 3, stable: 1, swing: 61, error: 7 });
  });

  it("may all be far off, and the nearest of them is named", () => {
    expect(neighbours(table([200, 28, 34, 0, 0, 0], [150, 28, 34, 1, 9, 0]), facts)).toEqual({ rooms: 2, like: 0, stable: 0, swing: 0, error: 0, nearest: { delay: 150, coupling: 28, lag: 34 } });
    expect(neighbours(table(), facts)).toMatchObject({ rooms: 0, like: 0, nearest: null });
    expect(neighbours(table(), { ...facts, hands: 5 })).toMatchObject({ rooms: 0, nearest: null });
  });
});

it("a room stays the same while its delay trembles", () => {
  expect(sameRoom(facts, { ...facts, delay: 104 })).toBe(true);
  expect(sameRoom(facts, { ...facts, delay: 106 })).toBe(false);
  expect(sameRoom(facts, { ...facts, hands: 3 })).toBe(false);
  expect(sameRoom(facts, { ...facts, rule: "pi" })).toBe(false);
});
