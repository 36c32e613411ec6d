import { expect, test } from "vitest";
import { reported, sent } from "../../../src/touch/network/pacing";
import { clockOffset, measured, shortestTrip, tickLate, UNTIMED } from "../../../src/touch/network/timing";
import { expectClose } from "../../close";
import { vectors } from "../../vectors";

interface Row {
  t_client: number;
  t_server: number;
  sample_wait: number;
  now: number;
  round_trip: number;
  jitter: number;
  clock_offset: number;
  due: number;
}

test("as the Python client, patches tell round trip, clock offset and the phase of sending", () => {
  let timing = UNTIMED;
  let pacer = { period: 0.016, due: 10 };
  (vectors("link") as Row[]).forEach((v, i) => {
    timing = measured(timing, v, v.now);
    pacer = sent(reported(pacer, v.t_client, v.sample_wait), v.now);
    const { round_trip, jitter } = timing;
    const { clock_offset, due } = v;
    expectClose(
      { round_trip, jitter, clock_offset: clockOffset(timing), due: pacer.due },
      { round_trip: v.round_trip, jitter: v.jitter, clock_offset, due },
      `row ${i}`,
    );
  });
});

test("the network's share is the shortest trip of late, whatever the page did in between", () => {
  let timing = UNTIMED;
  expect(shortestTrip(timing)).toBeNull();
  for (let i = 0; i < 60; i++) {
    const now = i / 60;
    timing = measured(timing, { t_client: now - (i % 7 === 3 ? 0.004 : 0.12), t_server: now, sample_wait: 0 }, now);
  }
  expect(timing.round_trip).toBeGreaterThan(0.05);
  expect(shortestTrip(timing)).toBeCloseTo(0.004, 9);
  // A network that became slow is known within two windows.
  for (let i = 60; i < 720; i++) timing = measured(timing, { t_client: i / 60 - 0.2, t_server: i / 60, sample_wait: 0 }, i / 60);
  expect(shortestTrip(timing)).toBeCloseTo(0.2, 9);
});

test("a tick is late by what the rate of ticks does not explain, and never early", () => {
  const before = { tick: 40, t_server: 1005 };
  expect(tickLate(null, before, 0.016)).toBe(0);
  expect(tickLate(before, { tick: 41, t_server: 1005.316 }, 0.016)).toBeCloseTo(0.3, 9);
  expect(tickLate(before, { tick: 50, t_server: 1005.16 }, 0.016)).toBeCloseTo(0, 9); // nine did not come here
  expect(tickLate(before, { tick: 41, t_server: 1005.01 }, 0.016)).toBe(0);
});
