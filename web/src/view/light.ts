/** The light of a room from all sides as numbers, so that no graphics have to compute it first. */

import { LightProbe } from "three";

/**
 * Radiance of three.js's RoomEnvironment in real spherical harmonics up to the second degree, z up; the same in each
 * colour. Integrated over cube faces of 256 by 256 pixels. Every page would have to compute the filtered map anew, which takes
 * seconds in software; the shades differ by less than a twentieth, and only the reflections at roughness 0.6 are lost.
 */
const ROOM = [3.7163, -1.5878, 1.731, 0.2657, 0.3426, -1.0352, -0.0726, 0.2064, -1.3342];

/** Factor that replaces those reflections. */
const SHEEN = 1.05;

export function roomLight(): LightProbe {
  const probe = new LightProbe();
  ROOM.forEach((value, i) => { probe.sh.coefficients[i]?.setScalar(SHEEN * value); });
  return probe;
}
