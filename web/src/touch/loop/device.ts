/** The device under the cursor: a simulated hand on a passive rig, whose force gives way to the surface. */

import type { HandSettings } from "../../model/hand";
import { along, dot, norm, sub, unit, type Vec3, ZERO } from "../../model/vec";
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

// What touches a hand that does not press is felt for a moment at most, whatever the page shows meanwhile: a page may
// draw five pictures a second, and the surface that it draws is a way through the network old.
const AWAY = 0.01; // m that such a hand wants to be away from where it is touched
const SINKING = 0.02; // m/s at which it goes back; it meets what is still there with about a tenth of a newton
const ELSEWHERE = 0.03; // m sideways from where it was touched, beyond which that says nothing

/** Hand, intention and cursor. */
export interface CursorState {
  readonly tip: HandState;
  /** On its way to the cursor [m]. */
  readonly intended: Vec3;
  /** Where a hand that does not press was touched, and does not go below; null where it goes to the cursor. */
  readonly floor: Floor | null;
}

/** A plane that sinks. */
interface Floor {
  /** [m] */
  readonly at: Vec3;
  readonly up: Vec3;
  /** Of the tip while it is touched [m]. */
  readonly away: number;
}

/** A hand at rest at the cursor. */
export function restAt(cursor: Vec3): CursorState {
  return { tip: { position: cursor, velocity: ZERO }, intended: cursor, floor: null };
}

/**
 * One period: the hand follows the cursor under `force` [N].
 *
 * @param presses Whether it is there to be touched. One that is not gives way to whatever touches it.
 */
export function follow(
  state: CursorState,
  hand: HandSettings,
  cursor: Vec3,
  presses: boolean,
  force: Vec3,
  dt: number,
): CursorState {
  const floor = presses ? null : floorUnder(state, cursor, force, dt);
  const wanted = floor === null ? cursor : along(cursor, heightOver(cursor, floor), floor.up);
  const intended = reach(state.intended, wanted, dt);
  return { tip: move(state.tip, hand, intended, force, dt), intended, floor };
}

/** Under the tip, as long as the cursor is below it. */
function floorUnder({ tip, floor }: CursorState, cursor: Vec3, force: Vec3, dt: number): Floor | null {
  const touched = norm(force) > 0;
  if (!touched && floor === null) return null;
  const from = touched ? unit(force) : (floor as Floor).up;
  // In a gap what is away from one side is in the other: a hand that both touch wants no more than that they let it.
  const beyond = floor !== null && dot(from, floor.up) < 0;
  const up = beyond ? floor.up : from;
  const away = beyond ? 0 : (floor?.away ?? AWAY);
  const at = touched ? along(tip.position, away, from) : along((floor as Floor).at, -SINKING * dt, up);
  const next = { at, up, away };
  const height = heightOver(cursor, next);
  const sideways = Math.hypot(...sub(along(cursor, height, up), next.at));
  return height <= 0 || sideways > ELSEWHERE ? null : next;
}

/** Of the floor over a place [m]. */
function heightOver(place: Vec3, { at, up }: Floor): number {
  return dot(sub(at, place), up);
}
