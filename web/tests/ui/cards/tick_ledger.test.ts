import { describe, expect, test } from "vitest";
import { rulesWords, tickWords } from "../../../src/ui/cards/tick_ledger";
import { NOTHING_CUT } from "../../users";

describe("what the server made of a force", () => {
  test("is not told where it left the force as it was", () => {
    expect(tickWords(NOTHING_CUT)).toBe("");
    expect(tickWords({ ...NOTHING_CUT, by_lag: 0.004 })).toBe("");
  });

  test("is told by stage and in newtons", () => {
    const ledger = { ...NOTHING_CUT, by_limit: -0.5, by_lag: 0.25, gain_cut: 120.4 };
    expect(tickWords(ledger)).toBe(
      "On its way to the object: less 0.50 N by limit, plus 0.25 N by lag. "
      + "Models of others stiffen the contact: the gain is 120 N/m less.",
    );
  });
});

describe("the rules of a loop", () => {
  test("are told where they differ", () => {
    expect(rulesWords(null)).toBe("");
    expect(rulesWords({ added: [], lacking: [] })).toBe("");
    expect(rulesWords({ added: ["edge"], lacking: ["models", "trust"] })).toBe("Rules of other packages: edge. Its loop has no rule: models, trust.");
  });
});
