import { expect, test } from "vitest";
import { clockTime } from "../../../src/ui/replay/words";

test("a time within a session is written in minutes, seconds and tenths, without a sixtieth second", () => {
  expect([0, 7.34, 59.94, 59.96, 60, 599.99, 3600].map(clockTime)).toEqual(["0:00.0", "0:07.3", "0:59.9", "1:00.0", "1:00.0", "10:00.0", "60:00.0"]);
  expect(clockTime(-1)).toBe("0:00.0");
});
