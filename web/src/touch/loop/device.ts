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

/** Largest damping of the passivity layer on this device at haptic period T [N s/m]. */
export function dampingLimit(device: DeviceInfo, haptic_period: number): number {
  return deviceDampingLimit(device.damping, device.max_stiffness, haptic_period);
}

// A hand that does not press feels a surface that touches it for a moment at most, without waiting for the page: a page
// may draw only five pictures a second, and the surface that it draws is old by the way through the network.
const AWAY = 0.01; // m by which such a hand moves away from where it is touched
const SINKING = 0.02; // m/s at which it goes back; if the surface is still there, they meet with about a tenth of a newton
const ELSEWHERE = 0.03; // m sideways from where it was touched, beyond which the floor no longer holds

/** State of the simulated hand that follows the cursor. */
export interface CursorState {
  readonly tip: HandState;
  /** Intended position, on its way to the cursor [m]. */
  readonly intended: Vec3;
  /** Plane below which a touched hand that does not press does not go; null if the hand goes to the cursor. */
  readonly floor: Floor | null;
  /** Displacement of the tip by the forces on it, and its velocity: where the tip would be without them is what others need to model the hand. */
  readonly gave: HandState;
}

/** A plane that sinks slowly. */
interface Floor {
  /** Point of the plane [m]. */
  readonly at: Vec3;
  readonly up: Vec3;
  /** Distance of the plane from the tip while the tip is touched [m]. */
  readonly away: number;
}

/** A hand at rest at the cursor. */
export function restAt(cursor: Vec3): CursorState {
  const gave = { position: ZERO, velocity: ZERO };
  return { tip: { position: cursor, velocity: ZERO }, intended: cursor, floor: null, gave };
}

/**
 * One period: the hand follows the cursor under `force` [N].
 *
 * @param presses Whether the hand presses; a hand that does not press gives way to any surface that touches it.
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
  const gave = move(state.gave, hand, ZERO, force, dt);
  return { tip: move(state.tip, hand, intended, force, dt), intended, floor, gave };
}

/** Floor under the tip while the cursor is below it; null for none. */
function floorUnder({ tip, floor }: CursorState, cursor: Vec3, force: Vec3, dt: number): Floor | null {
  const touched = norm(force) > 0;
  if (!touched && floor === null) return null;
  const from = touched ? unit(force) : (floor as Floor).up;
  // In a gap, away from one side is into the other: a hand that both sides touch stays on the surface and keeps no distance.
  const beyond = floor !== null && dot(from, floor.up) < 0;
  const up = beyond ? floor.up : from;
  const away = beyond ? 0 : (floor?.away ?? AWAY);
  const at = touched ? along(tip.position, away, from) : along((floor as Floor).at, -SINKING * dt, up);
  const next = { at, up, away };
  const height = heightOver(cursor, next);
  const sideways = Math.hypot(...sub(along(cursor, height, up), next.at));
  return height <= 0 || sideways > ELSEWHERE ? null : next;
}

/** Height of the floor over a place [m]. */
function heightOver(place: Vec3, { at, up }: Floor): number {
  return dot(sub(at, place), up);
}
