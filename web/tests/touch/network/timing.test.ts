import { test } from "vitest";
import { reported, sent } from "../../../src/touch/network/pacing";
import { clockOffset, measured, UNTIMED } from "../../../src/touch/network/timing";
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
