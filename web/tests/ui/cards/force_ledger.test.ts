import { expect, test } from "vitest";
import { reach } from "../../../src/ui/cards/force_ledger";

test("bars hold what is taken away at once, too", () => {
  const none = { surface: 0, models: 0, gain: 0, depth: 0, law: 0, damping: 0, friction: 0, limit: 0, fade: 0, rate: 0 };
  expect(reach({ ...none, surface: 5, damping: 2, fade: -7 })).toBe(7);
  expect(reach({ ...none, surface: -1 })).toBe(0);
});
