import { expect, test } from "vitest";
import { followerWords, pointedWords, watchingWords } from "../../src/company/words";

const company = { watching: 3, open: [], following: null, followers: [], may_point: true };

test("how many watch is said, and of nobody nothing", () => {
  expect(watchingWords(company)).toBe("3 watching");
  expect(watchingWords({ ...company, watching: 0 })).toBe("");
  expect(watchingWords(null)).toBe("");
});

test("who follows is said by name, of many by number", () => {
  const [bob, eve] = [{ user: 2, name: "bob" }, { user: null, name: "eve" }];
  expect(followerWords([])).toBe("");
  expect(followerWords([bob])).toBe("bob sees what you see.");
  expect(followerWords([bob, eve])).toBe("bob and eve (watching) see what you see.");
  expect(followerWords([bob, eve, bob])).toBe("bob and 2 others see what you see.");
});

test("who points is said, and who only watches is told apart", () => {
  const mark = { user: null, name: "ann", point: [0, 0, 0], at: 1 } as const;
  expect(pointedWords(mark, false)).toBe("ann (watching) points at the object.");
  expect(pointedWords({ ...mark, user: 2 }, true)).toBe("You point at the object.");
});
