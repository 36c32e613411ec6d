/** Position of the camera as numbers: on a sphere round the body, with z up. */

import type { Vec3 } from "../model/vec";

export interface Orbit {
  /** Angle around the vertical [rad]; 0 looks from +x. */
  readonly azimuth: number;
  /** Angle above the horizon [rad]. */
  readonly elevation: number;
  /** Distance from the body's middle, in radii of the body. */
  readonly distance: number;
}

/** Initial view: it shows both the left and the right hand of the demo, which are on the x axis. */
export const HOME: Orbit = { azimuth: -1.36, elevation: 0.26, distance: 5.4 };
export const NEAREST = 1.6;
export const FARTHEST = 12;
export const STEEPEST = 1.5;

export function rotated(orbit: Orbit, right: number, up: number): Orbit {
  return {
    ...orbit,
    azimuth: orbit.azimuth + right,
    elevation: Math.min(STEEPEST, Math.max(-0.4, orbit.elevation + up)),
  };
}

/** @param factor Factor on the distance; above 1 moves away. */
export function zoomed(orbit: Orbit, factor: number): Orbit {
  return { ...orbit, distance: Math.min(FARTHEST, Math.max(NEAREST, orbit.distance * factor)) };
}

/** Position of the eye [m]. */
export function eye(orbit: Orbit, center: Vec3, radius: number): Vec3 {
  const r = orbit.distance * radius;
  const flat = r * Math.cos(orbit.elevation);
  return [
    center[0] + flat * Math.cos(orbit.azimuth),
    center[1] + flat * Math.sin(orbit.azimuth),
    center[2] + r * Math.sin(orbit.elevation),
  ];
}

/** One step towards a target view with exponential damping; reaches it exactly, so that drawing can stop. */
export function eased(from: Orbit, to: Orbit, dt: number, seconds = 0.09): Orbit {
  const s = 1 - Math.exp(-Math.max(0, dt) / seconds);
  const next: Orbit = {
    azimuth: from.azimuth + s * (to.azimuth - from.azimuth),
    elevation: from.elevation + s * (to.elevation - from.elevation),
    distance: from.distance + s * (to.distance - from.distance),
  };
  const left =
    Math.abs(next.azimuth - to.azimuth) + Math.abs(next.elevation - to.elevation) + Math.abs(next.distance - to.distance);
  return left < 1e-3 ? to : next;
}

/** The same view with an azimuth less than half a turn from another's, so that the camera takes the short way. */
export function nearTurn(orbit: Orbit, other: Orbit): Orbit {
  const turns = Math.round((other.azimuth - orbit.azimuth) / (2 * Math.PI));
  return { ...orbit, azimuth: orbit.azimuth + 2 * Math.PI * turns };
}

/** A view from which a place with this outward direction is seen from the side. */
export function facing(direction: Vec3, side = 0.9): Orbit {
  return { ...HOME, azimuth: Math.atan2(direction[1], direction[0]) + side };
}
