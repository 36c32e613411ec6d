/** A user at rest on the +x side of a body of 0.1 m. */

import type { UserState } from "../src/model/scene";

/** What a tick made of a force that it left as it was. */
export const NOTHING_CUT = { by_presence: 0, by_limit: 0, by_anticipation: 0, by_lag: 0, by_rate: 0, gain_cut: 0 };

export function user(number: number): UserState {
  return {
    user: number, name: "", probe: [0.1, 0, 0], foot: [0.1, 0, 0], x_free: [0.1, 0, 0], normal: [1, 0, 0], force: [0, 0, 0],
    c_ii: 1 / 250, k_o_coupled: 140, k_h: 126, integral_gain: 0, loop_delay: 0.05, curvature: 10, law: "proportional",
    geometry: "sphere", fresh: true, friction: false, presence: 1, latency: { delay: 0, jitter: 0, network: "" }, rules: null, ledger: NOTHING_CUT,
  };
}
