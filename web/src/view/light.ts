/** The light of a room from all sides, as numbers: no graphics have to find it first. */

import { LightProbe } from "three";

/**
 * Radiance of three.js's RoomEnvironment in real spherical harmonics up to the second degree, z up; the same in each
 * colour. Integrated over cube faces of 256 by 256 pixels. Its filtered map, found anew by every page, took seconds of
 * graphics in software, for the same shades within a twentieth: without it, only reflections at roughness 0.6 are gone.
 */
const ROOM = [3.7163, -1.5878, 1.731, 0.2657, 0.3426, -1.0352, -0.0726, 0.2064, -1.3342];

/** In the place of those reflections. */
const SHEEN = 1.05;

export function roomLight(): LightProbe {
  const probe = new LightProbe();
  ROOM.forEach((value, i) => { probe.sh.coefficients[i]?.setScalar(SHEEN * value); });
  return probe;
}
