import { expect, it } from "vitest";
import { BETWEEN, LEFT, PIECE, RIGHT } from "../../../src/ui/plots/strokes";

it("the names of probe and proxy have room beside that of their lane, in the narrowest panel", () => {
  // At 200 % a panel of 213 px; widths of "position, mm", "probe" and "proxy" at 11 px, in px.
  const free = 213 - LEFT - RIGHT - 69;
  expect(30 + 31 + 2 * (4 + PIECE) + BETWEEN).toBeLessThan(free);
});
