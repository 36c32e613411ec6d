import { describe, expect, it } from "vitest";
import { pressing, pressWords, pushWords } from "../../src/company/told";
import { user } from "../users";

const [ann, bob, cyd] = [{ user: 1, name: "Ann" }, { user: 2, name: "Bob" }, { user: 3, name: "" }] as const;

describe("what one feels", () => {
  it("is said of the one who causes it, of two by their names, of more together", () => {
    expect(pushWords(1.23, [ann])).toBe("Ann pushes you: 1.2 N");
    expect(pushWords(1.23, [ann, bob])).toBe("Ann and Bob push you: 1.2 N");
    expect(pushWords(1.23, [ann, bob, cyd])).toBe("Others push you: 1.2 N");
    expect(pushWords(1.23, [cyd])).toBe("User 3 pushes you: 1.2 N");
    expect(pushWords(-0.3, [ann])).toBe("Ann draws the surface away from you: 0.3 N less");
  });

  it("is said of nobody where nobody is known to press, or too little is felt", () => {
    expect(pushWords(1.23, [])).toBe("");
    expect(pushWords(0.04, [ann])).toBe("");
  });
});

describe("who presses", () => {
  it("is whoever else has a force that the object takes", () => {
    const users = [1, 2, 3, 4].map((n) => ({ ...user(n), c_ii: n === 4 ? 0 : 0.004, force: [0, 0, n === 3 ? 0.01 : 1] as const }));
    const free = { frozen: false, muted: [] };
    const numbers = (own: number, restraints: { frozen: boolean; muted: number[] }): number[] => pressing({ users }, own, restraints).map((one) => one.user);
    expect(numbers(0, free)).toEqual([1, 2]);
    expect(numbers(1, free)).toEqual([2]);
    expect(numbers(1, { frozen: false, muted: [2] })).toEqual([]);
    expect(numbers(0, { frozen: true, muted: [] })).toEqual([]);
  });

  it("is told together", () => {
    expect([[], [ann], [ann, bob], [ann, bob, cyd]].map(pressWords)).toEqual(["", "Ann presses.", "Ann and Bob press.", "Others press."]);
  });

  it("is told in few words, however long the names are", () => {
    const long = { user: 4, name: "W".repeat(32) };
    expect(pressWords([ann, long])).toBe("Others press.");
    expect(pressWords([long])).toBe(`${long.name} presses.`);
  });
});
