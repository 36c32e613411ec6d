/**
 * Pure functions for the position of the tip: the trigger moves it inward, the sticks move its starting point.
 *
 * `client/cohaptic_drivers/dualsense/cursor.py` in TypeScript.
 */

import { add, along, cross, scale, unit, type Vec3 } from "../model/vec";
import { type Held, MOST } from "./reports";

export const RELEASED = 5; // of 255; a trigger that nobody touches may rest a little off zero
const FASTEST = 0.5; // m/s of the tip by the trigger
const SMOOTH = 0.004; // s; interval of the pad's reports, between which the tip moves on
const DEAD_BAND = 0.1; // of full scale; a stick that nobody touches rests a little off its centre
const AT_REST = 1e-4; // m; a smaller press counts as none
const SPEED = 0.15; // m/s of the tip by a stick, along each axis, at full deflection

/** Directions of trigger and sticks in the world: unit vectors at right angles. */
export interface Axes {
  readonly side: Vec3;
  readonly up: Vec3;
  readonly inward: Vec3;
}

/** Space in which the tip moves, around the object's centre [m]: its way over the whole trigger, and the sticks' reach. */
export interface Room {
  readonly depth: number;
  readonly reach: number;
}

/** Position of the tip along the axes of the pad [m]. */
export interface Cursor {
  readonly side: number;
  readonly up: number;
  /** Distance along `inward` from the centre, with the trigger released; negative in front. */
  readonly base: number;
  /** Distance along `inward` from `base`, by the trigger. */
  readonly press: number;
  /** Whether the right stick has to be let go before it moves the tip inward again. */
  readonly blocked: boolean;
}

export function cursorAt(base: number): Cursor {
  return { side: 0, up: 0, base, press: 0, blocked: false };
}

/**
 * The cursor after a step of `dt` [s].
 *
 * @param contact Whether the tip feels a force.
 */
export function moved(cursor: Cursor, held: Held, dt: number, room: Room, contact: boolean): Cursor {
  let speed = rate(held.right[1]);
  // After a quick release of the trigger the tip still follows it, and so leaves the object anyway.
  const released = held.pull <= RELEASED && cursor.press <= AT_REST;
  const blocked = speed > 0 && (cursor.blocked || (contact && released));
  if (released && contact) speed = -SPEED;
  else if (contact || blocked) speed = Math.min(speed, 0);
  const goal = (room.depth * Math.max(0, held.pull - RELEASED)) / (MOST - RELEASED);
  const step = within((goal - cursor.press) * -Math.expm1(-dt / SMOOTH), FASTEST * dt);
  return {
    side: within(cursor.side + rate(held.left[0]) * dt, room.reach),
    up: within(cursor.up + rate(held.left[1]) * dt, room.reach),
    base: Math.min(0, Math.max(-room.reach, cursor.base + speed * dt)),
    press: cursor.press + step,
    blocked,
  };
}

/** Pull of the trigger that corresponds to the present press of the tip, 0 to 255. */
export function pullOf(cursor: Cursor, room: Room): number {
  return Math.round(RELEASED + ((MOST - RELEASED) * cursor.press) / room.depth);
}

/** Position of the tip from the object's centre [m]. */
export function placeOf(cursor: Cursor, { side, up, inward }: Axes): Vec3 {
  return along(add(scale(side, cursor.side), scale(up, cursor.up)), cursor.base + cursor.press, inward);
}

/** Axes for a viewer of the object: inward is away from the eye. */
export function axesOf(towards_eye: Vec3): Axes {
  const inward = scale(unit(towards_eye, [0, -1, 0]), -1);
  const side = unit(cross(inward, [0, 0, 1]), [1, 0, 0]);
  return { side, up: cross(side, inward), inward };
}

function rate(stick: number): number {
  const beyond = Math.abs(stick) - DEAD_BAND;
  return beyond > 0 ? (Math.sign(stick) * SPEED * beyond) / (1 - DEAD_BAND) : 0;
}

function within(value: number, most: number): number {
  return Math.max(-most, Math.min(most, value));
}
