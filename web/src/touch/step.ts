/**
 * One period of the haptic loop as a pure function.
 *
 * `client/cohaptic_client/step.py` in TypeScript, for planes and spheres: what a patch does when it arrives is in
 * `arrival.ts`, what a surface does to a hand in `press.ts`, what the loop remembers in `loop.ts`.
 */

import type { Compliance3 } from "../types";
import { add, dot, norm, scale, sub } from "../vec";
import { isSilent, shown } from "./arrival";
import type { DeviceSample, LoopSettings, LoopState, Output } from "./loop";
import { givenShare, NOTHING_OWED, observe } from "./passivity";
import { NOTHING, press } from "./press";
import { guard } from "./safety";

/** One haptic period: from a device's sample to the force it gets. */
export function step(
  state: LoopState,
  sample: DeviceSample,
  now: number,
  settings: LoopSettings,
): [state: LoopState, output: Output] {
  const dt = state.safety.now === null ? 0 : now - state.safety.now;
  const silent = isSilent(state, now, settings);
  const sight = shown(state, sample.position, now, settings);
  const C = complianceNow(state, dt, settings);
  const { patch, fade } = state;
  const pressed =
    sight === null || patch === null || fade === null
      ? { ...NOTHING, fade }
      : press(state, patch, fade, { sample, sight, C, now, dt, silent }, settings);
  const { wanted, local } = pressed;
  const safety = guard(state.safety, wanted, now, sample.velocity, silent, settings.limits);
  const size = norm(wanted);
  const ratio = size > 0 ? norm(safety.force) / size : safety.scale;
  let passivity = NOTHING_OWED;
  if (settings.max_damping > 0 && state.sight !== null) {
    const before = state.passivity;
    const stored = givenShare(pressed.stored, ratio, safety.scale);
    const work = 0.5 * dot(add(state.safety.force, safety.force), sub(sample.position, state.probe));
    const owed = observe(before.owed, work, stored - before.stored, pressed.from_body, dt);
    passivity = { owed, damping: pressed.damping, stored };
  }
  const after: LoopState = {
    ...state,
    fade: pressed.fade,
    normal_force: local.normal_force,
    sight,
    depth: pressed.depth,
    probe: sample.position,
    passivity,
    friction: pressed.friction,
    compliance: C,
    safety,
  };
  const output: Output = {
    force: safety.force,
    on_body: scale(pressed.on_body, ratio),
    local,
    damping_force: pressed.damped - local.normal_force,
    u_others: sight === null ? 0 : dot(sight.u_others, sight.normal),
    silent,
  };
  return [after, output];
}

/** Compliance that the friction uses, on its way to the newest patch's; null without friction. */
function complianceNow(state: LoopState, dt: number, settings: LoopSettings): Compliance3 | null {
  const newest = state.patch?.compliance ?? null;
  if (settings.friction <= 0 || newest === null) return null;
  const was = state.compliance;
  if (was === null) return newest;
  const s = Math.min(1, dt / settings.simulation_period);
  const [xx, yy, zz, xy, xz, yz] = newest;
  const mid = (a: number, b: number): number => a + s * (b - a);
  return [mid(was[0], xx), mid(was[1], yy), mid(was[2], zz), mid(was[3], xy), mid(was[4], xz), mid(was[5], yz)];
}
