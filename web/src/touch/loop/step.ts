/** One period of the haptic loop as a pure function, as `client/cohaptic_client/loop/step.py`: the rules of `chain.ts` in their order. */

import { played } from "./arrival";
import { CHAIN } from "./chain";
import { Period } from "./period";
import type { DeviceSample, LoopSettings, LoopState } from "./state";

/** One haptic period, from a device's sample to the force it gets: the state after it, and the period with its results. */
export function step(last: LoopState, sample: DeviceSample, now: number, settings: LoopSettings): [state: LoopState, period: Period] {
  const period = new Period(last, sample, now, settings);
  for (const [, apply] of CHAIN) apply(period);
  const { state, fade, sight, depth, normal, passivity, friction, compliance, safety } = period;
  const after: LoopState = {
    ...state, fade, sight, depth, normal, passivity, friction, compliance, safety,
    normal_force: period.local.normal_force,
    probe: sample.position,
    playout: played(state, now, period.dt, settings),
  };
  return [after, period];
}
