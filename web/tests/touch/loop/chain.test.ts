import { expect, test } from "vitest";
import { RULES } from "../../../src/model/rules";
import { CHAIN } from "../../../src/touch/loop/chain";

test("the rules that the page has stand in the order of the Python client's", () => {
  const mine = CHAIN.map(([name]) => name);
  expect(mine).toEqual(Object.keys(RULES).filter((name) => (mine as string[]).includes(name)));
});
