import { expect, test } from "vitest";
import { RULES } from "../../../src/model/rules";
import { CHAIN, LACKING } from "../../../src/touch/loop/chain";

test("the rules that the page has stand in the order of the Python client's", () => {
  const mine = CHAIN.map(([name]) => name);
  expect(mine).toEqual(Object.keys(RULES).filter((name) => (mine as string[]).includes(name)));
});

test("what the page lacks of them is computed, in their order", () => {
  expect(LACKING).toEqual(["reach", "models", "finite", "trust"]);
});
