import { expect, test } from "vitest";
import { missingFrom, reach } from "../../../src/ui/cards/force_ledger";
import { CHAIN } from "../../../src/touch/loop/chain";

test("what the page's loop lacks of the Python client's is computed, in order", () => {
  expect(missingFrom(CHAIN.map(([name]) => name))).toEqual(["reach", "models", "finite", "trust"]);
  expect(missingFrom(["surface", "law", "limits", "trust"]).slice(0, 3)).toEqual(["reach", "models", "fades"]);
});

test("bars hold what is taken away at once, too", () => {
  const none = { surface: 0, models: 0, gain: 0, depth: 0, law: 0, damping: 0, friction: 0, limit: 0, fade: 0, rate: 0 };
  expect(reach({ ...none, surface: 5, damping: 2, fade: -7 })).toBe(7);
  expect(reach({ ...none, surface: -1 })).toBe(0);
});
