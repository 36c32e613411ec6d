/** The device under the cursor: a simulated hand on a passive rig, whose force gives way to the surface. */

import type { HandSettings } from "../../model/hand";
import { type Vec3, ZERO } from "../../model/vec";
import { deviceDampingLimit } from "./passivity";
import { type HandState, move, reach } from "./simulated_hand";

/** Properties of the device; the values are those of the Python client's simulated one. */
export interface DeviceInfo {
  /** Largest stiffness that it renders stably [N/m]. */
  readonly max_stiffness: number;
  /** Damping of its tip [N s/m]. */
  readonly damping: number;
  /** A loop that stood still for longer lets the hand go [s]; this hand stands still with it. */
  readonly stall: number;
}

export const CURSOR: DeviceInfo = { max_stiffness: 2000, damping: 10, stall: 1 };

/** Of the passivity layer on this device at haptic period T [N s/m]. */
export function dampingLimit(device: DeviceInfo, haptic_period: number): number {
  return deviceDampingLimit(device.damping, device.max_stiffness, haptic_period);
}

/** Hand, intention and cursor. */
export interface CursorState {
  readonly tip: HandState;
  /** On its way to the cursor [m]. */
  readonly intended: Vec3;
}

/** A hand at rest at the cursor. */
export function restAt(cursor: Vec3): CursorState {
  return { tip: { position: cursor, velocity: ZERO }, intended: cursor };
}

/** One period: the hand follows the cursor under `force` [N]. */
export function follow(
  state: CursorState,
  hand: HandSettings,
  cursor: Vec3,
  force: Vec3,
  dt: number,
): CursorState {
  const intended = reach(state.intended, cursor, dt);
  return { tip: move(state.tip, hand, intended, force, dt), intended };
}
