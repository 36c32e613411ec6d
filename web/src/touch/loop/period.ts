/**
 * One period of the loop while it is computed: the only thing that changes, for a millisecond.
 *
 * The rules of `chain.ts` fill it in, each by what the rules before it have left there. In the end it is the result: it
 * holds the force for the device, and all that memory and ledger are made from. Without a surface the fields of the
 * contact stay as they begin. `client/cohaptic_client/loop/period.py` in TypeScript.
 */

import { anchorOf, type FrictionState, NO_FRICTION } from "../../control/friction";
import type { Sight } from "../../control/geometry";
import { type LocalForce, NO_FORCE } from "../../control/law";
import type { Compliance3 } from "../../model/body";
import { dot, norm, type Vec3, ZERO } from "../../model/vec";
import { MAX_POSITION } from "../../protocol/layout";
import { Budget } from "./budget";
import type { LawFade } from "./law_fade";
import { NOTHING_OWED, type Passivity } from "./passivity";
import { EXTERNAL_RATE, FADE_RATE, type SafetyState } from "./safety";
import type { DeviceSample, LoopSettings, LoopState } from "./state";

export class Period {
  /** Time since the last period [s]. */
  readonly dt: number;
  /** The same, at most two haptic periods: a late period moves the force by no more than two punctual ones [s]. */
  readonly counted: number;
  /** Change of the force that the hand's own motion does not cause. */
  readonly budget: Budget;

  /** Whether the server counts as silent. */
  silent = true;
  /** Completed fraction of the move to the newest patch, 0 to 1. */
  fraction = 0;
  /** Sample of the shown surface at the probe; null before the first patch. */
  sight: Sight | null = null;

  /** Law in use; null before the first patch. */
  fade: LawFade | null = null;
  /** Gain that the surface asks for [N/m]. */
  k_wanted = 0;
  /** Largest gain of the laws in use [N/m]. */
  k_h = 0;
  /** Largest changes of the force by a fade of the safety layer, and by the change from one law to the next [N]. */
  fade_limit: number;
  law_fade_limit = 0;
  /** Largest change of the damping of a slow hand [N s/m]. */
  damping_limit = Infinity;
  /** Compliance of the contact [m/N]; null without friction. */
  compliance: Compliance3 | null = null;
  /** Part of the budget that friction has [N]. */
  for_friction = 0;
  /** Direction of the normal force. */
  normal: Vec3 = [0, 0, 1];
  /** Displacement of the hand in this period [m]. */
  moved: Vec3 = ZERO;
  /** Component of that displacement into the surface [m]. */
  moved_in = 0;
  /** Depth of the probe below the surface, as far as the budget lets the surface move it [m]. */
  depth = -Infinity;
  /** Largest change of the law's force that the hand's own motion does not cause [N]. */
  max_change = 0;

  /** Depth on which the law presses [m]. */
  law_depth = 0;
  local: LocalForce = NO_FORCE;
  /** Damping of the passivity layer [N s/m]. */
  damping = 0;
  /** Normal force with that damping [N]. */
  damped_force = 0;
  /** State of the friction after this period. */
  friction: FrictionState = NO_FRICTION;
  /** Force of law and friction, whose opposite the body gets [N]. */
  law_force: Vec3 = ZERO;
  /** Force of law, friction and damping [N]. */
  asked: Vec3 = ZERO;

  /** Whether a fault takes the force away. */
  let_go = false;
  /** Memory of the safety layer after this period. */
  safety: SafetyState;
  /** Force on the hand, for the device; each rule of the guard replaces it [N]. */
  force: Vec3 = ZERO;
  /** Its size, divided by that of the one that was asked for. */
  given_ratio = 0;
  /** Memory of the passivity layer after this period. */
  passivity: Passivity = NOTHING_OWED;
  /** Force whose opposite acts on the body: without the damping, which acts on the hand only [N]. */
  on_body: Vec3 = ZERO;

  /** @param state Memory after the last period; rule `surface` replaces it by that with the patch whose time has come. */
  constructor(
    public state: LoopState,
    readonly sample: DeviceSample,
    readonly now: number,
    readonly settings: LoopSettings,
  ) {
    const { safety } = state;
    this.dt = safety.now === null ? 0 : Math.max(0, now - safety.now);
    this.counted = Math.min(this.dt, 2 * settings.limits.period);
    this.budget = new Budget(EXTERNAL_RATE * this.counted);
    this.fade_limit = FADE_RATE * this.counted;
    this.safety = safety;
  }

  /** Damping force of the passivity layer, along the normal [N]. */
  get damping_force(): number {
    return this.damped_force - this.local.normal_force;
  }

  /** Displacement of the contact point by the others, along the normal [m]. */
  get u_others(): number {
    return this.sight === null ? 0 : dot(this.sight.u_others, this.sight.normal);
  }

  /** Point of the resting surface to which friction holds the contact [m]; null if there is none, or none to be sent. */
  get anchor(): Vec3 | null {
    const anchor = anchorOf(this.friction, this.sample.position, this.normal, this.depth);
    return anchor !== null && norm(anchor) <= MAX_POSITION ? anchor : null;
  }
}
