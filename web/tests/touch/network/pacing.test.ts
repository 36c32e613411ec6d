import { expect, test } from "vitest";
import { reported, sent } from "../../../src/touch/network/pacing";

test("a schedule locks to the server's ticks, whatever the delay", () => {
  for (const delay of [0.001, 0.02, 0.3]) {
    const period = 1 / 60;
    let pacer = { period, due: 0.005 };
    let wait = 0;
    for (let i = 0; i < 300; i += 1) {
      const at = pacer.due;
      const arrives = at + delay;
      wait = Math.ceil(arrives / period) * period - arrives;
      pacer = reported(sent(pacer, at), at, wait);
    }
    expect(wait).toBeGreaterThan(0.001);
    expect(wait).toBeLessThan(0.003);
  }
});
