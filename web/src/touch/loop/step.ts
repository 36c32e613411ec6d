/**
 * One period of the haptic loop as a pure function.
 *
 * `client/cohaptic_client/loop/step.py` in TypeScript, for planes and spheres: the arrival of a patch is in
 * `arrival.ts`, the force of a surface on the hand in `contact_force.ts`, the state of the loop in `state.ts`.
 */

import { anchorOf } from "../../control/friction";
import { add, dot, norm, scale, sub, type Vec3, ZERO } from "../../model/vec";
import { MAX_POSITION } from "../../protocol/layout";
import { isSilent, play, played, progress, shown } from "./arrival";
import { NO_CONTACT, contactForce } from "./contact_force";
import { givenShare, NOTHING_OWED, observe } from "./passivity";
import { guard } from "./safety";
import type { DeviceSample, LoopSettings, LoopState, Output } from "./state";

/** One haptic period: from a device's sample to the force it gets. */
export function step(
  last: LoopState,
  sample: DeviceSample,
  now: number,
  settings: LoopSettings,
): [state: LoopState, output: Output] {
  const state = play(last, now, settings);
  const dt = state.safety.now === null ? 0 : Math.max(0, now - state.safety.now);
  // A late period moves the force by no more than two punctual ones.
  const counted = Math.min(dt, 2 * settings.limits.period);
  const silent = isSilent(state, now, settings);
  const sight = shown(state, sample.position, progress(state, now));
  const { patch, fade } = state;
  const contact =
    sight === null || patch === null || fade === null
      ? { ...NO_CONTACT, fade, normal: state.normal }
      : contactForce(state, patch, fade, { sample, sight, now, counted, silent }, settings);
  const { requested, local } = contact;
  const safety = guard(state.safety, requested, now, sample.velocity, silent, settings.limits);
  const size = norm(requested);
  const ratio = size > 0 ? norm(safety.force) / size : safety.scale;
  let passivity = NOTHING_OWED;
  if (settings.max_damping > 0 && state.sight !== null) {
    const before = state.passivity;
    const stored = givenShare(contact.stored, ratio, safety.scale);
    const work = 0.5 * dot(add(state.safety.force, safety.force), sub(sample.position, state.probe));
    const owed = observe(before.owed, work, stored - before.stored, contact.from_body, dt);
    passivity = { owed, damping: contact.damping, stored };
  }
  const after: LoopState = {
    ...state,
    fade: contact.fade,
    normal_force: local.normal_force,
    sight,
    depth: contact.depth,
    probe: sample.position,
    passivity,
    normal: contact.normal,
    friction: contact.friction,
    compliance: contact.compliance,
    safety,
    playout: played(state, now, dt, settings),
  };
  const output: Output = {
    force: safety.force,
    on_body: onBody(contact.on_body, ratio, settings.limits.max_force),
    anchor: told(anchorOf(contact.friction, sample.position, contact.normal, contact.depth)),
    local,
    damping_force: contact.damped - local.normal_force,
    u_others: sight === null ? 0 : dot(sight.u_others, sight.normal),
    silent,
  };
  return [after, output];
}

/** The anchor to send to the server; null if it is not finite or out of range. */
function told(anchor: Vec3 | null): Vec3 | null {
  return anchor !== null && norm(anchor) <= MAX_POSITION ? anchor : null;
}

/**
 * The part of the law's force that the body gets: the same share as the hand, and never more than the law's.
 *
 * Damping may cancel nearly all of the law's force, or double it, and does not act on the body; while the hand's force
 * still falls to the law's force, the body gets the law's force.
 */
function onBody(force: Vec3, ratio: number, max_force: number): Vec3 {
  const size = norm(force);
  if (!Number.isFinite(size)) return ZERO;
  const share = Math.min(1, ratio);
  return scale(force, size * share > max_force ? max_force / size : share);
}
