/** Settings, memory and input of one client's haptic loop; `period.ts` is what a period computes with them. */

import { type FrictionState, NO_FRICTION } from "../../control/friction";
import type { Sight } from "../../control/geometry";
import { DEFAULT_LAW_SETTINGS, type LawSettings } from "../../control/law";
import { begun, type Playout } from "../../control/playout";
import type { Compliance3 } from "../../model/body";
import { type Vec3, ZERO } from "../../model/vec";
import type { Patch } from "../../protocol/patch";
import type { LawFade } from "./law_fade";
import { NOTHING_OWED, type Passivity } from "./passivity";
import { DEFAULT_LIMITS, NOT_ENGAGED, rateOf, type SafetyLimits, type SafetyState } from "./safety";

/** Settings of one client's loop. */
export interface LoopSettings {
  /** Time between patches, N T [s]. */
  readonly simulation_period: number;
  readonly limits: SafetyLimits;
  readonly law: LawSettings;
  /** Share of a simulation period over which the loop moves to a new patch; 0 holds it as the paper does. */
  readonly smoothing: number;
  /** Largest damping of the passivity layer; 0 switches the layer off [N s/m]. */
  readonly max_damping: number;
  /** mu of the contact; 0 for none. */
  readonly friction: number;
  /** Whether gains follow the compliance under the probe; false for gains that the user has fixed. */
  readonly follow: boolean;
  /** Largest gain that the device renders stably [N/m]. */
  readonly max_stiffness: number;
}

/** The settings of a loop at a server with this period, for a device that renders this stiffness [N/m]. */
export function loopSettings(
  simulation_period: number,
  max_force: number,
  stall: number,
  max_stiffness: number,
): LoopSettings {
  return {
    simulation_period,
    limits: {
      ...DEFAULT_LIMITS,
      max_force,
      max_rate: rateOf(max_stiffness),
      stall,
      // Three ticks, at least 0.1 s: jitter below that does not disturb the hand.
      silent_after: Math.max(0.1, 3 * simulation_period),
    },
    // The integral's force fades over two simulation periods (5.1), but by at most 1 % of it per millisecond.
    law: { ...DEFAULT_LAW_SETTINGS, release_time: Math.max(0.1, 2 * simulation_period), max_force },
    smoothing: 1,
    max_damping: 0,
    friction: 0,
    follow: true,
    max_stiffness,
  };
}

/** Tip of a device in the world frame. */
export interface DeviceSample {
  /** [m] */
  readonly position: Vec3;
  /** [m/s] */
  readonly velocity: Vec3;
}

/** Memory of the loop. */
export interface LoopState {
  /** Newest patch that is shown, or moved to; null before the first. */
  readonly patch: Patch | null;
  /** Time at which the newest patch came [s]. */
  readonly arrived: number;
  readonly before: Patch | null;
  /** The surface in use when the move to `patch` began, minus that of `before`. */
  readonly offset: Sight | null;
  /** Gain in use when the move to `patch` began [N/m]. */
  readonly k_h_before: number;
  /** Law in use; null before the first patch. */
  readonly fade: LawFade | null;
  /** Force of the law in the last period [N]. */
  readonly normal_force: number;
  /** Surface at the probe in the last period; null before the first. */
  readonly sight: Sight | null;
  /** Depth on which the law pressed in the last period, `holdBack` [m]. */
  readonly depth: number;
  /** Position in the last period [m]. */
  readonly probe: Vec3;
  /** Direction in which the law pressed in the last period, `turnBack`. */
  readonly normal: Vec3;
  readonly passivity: Passivity;
  /** Memory of the sticking contact. */
  readonly friction: FrictionState;
  /** Compliance that the friction uses, in transition to that of the newest patch; null without one. */
  readonly compliance: Compliance3 | null;
  readonly safety: SafetyState;
  /** Longest normal silence of the server on this link [s]. */
  readonly patience: number;
  /** Playing time of patches. */
  readonly playout: Playout;
  /** Patches whose time is still to come, oldest first. */
  readonly coming: readonly Patch[];
  /** Playing times at which the move to `patch` begins and ends [s]. */
  readonly move: readonly [begins: number, ends: number];
}

export const START: LoopState = {
  patch: null,
  arrived: -Infinity,
  before: null,
  offset: null,
  k_h_before: 0,
  fade: null,
  normal_force: 0,
  sight: null,
  depth: -Infinity,
  probe: ZERO,
  normal: [0, 0, 1],
  passivity: NOTHING_OWED,
  friction: NO_FRICTION,
  compliance: null,
  safety: NOT_ENGAGED,
  patience: 0,
  playout: begun(0),
  coming: [],
  move: [0, 0],
};
