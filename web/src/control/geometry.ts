/**
 * The local surface that a client holds between patches, and its value at a probe.
 *
 * Plane and sphere (Adachi 1995); `shared/cohaptic/control/geometry.py` in TypeScript. A surface is free of the
 * client's own force (science 3.3), so a new patch alone never moves the force.
 */

import { add, dot, lerp, sub, unit, type Vec3 } from "../model/vec";

/** A local surface evaluated at one probe: all that a law needs. */
export interface Sight {
  /** Depth of the probe below the surface, negative outside [m]. */
  readonly depth: number;
  /** Outward unit normal at the foot of the probe. */
  readonly normal: Vec3;
  /** Compliance of the contact there [m/N]. */
  readonly c_ii: number;
  /** Force on this hand at the patch's tick; the body carries its opposite [N]. */
  readonly own_force: Vec3;
  /** Displacement of the material under the contact by the others [m]. */
  readonly u_others: Vec3;
}

/** Plane or sphere; a patch has these fields. */
export interface LocalSurface {
  /** Contact point without this client's own force [m]. */
  readonly x_free: Vec3;
  readonly normal: Vec3;
  /** 0 for a plane, 1/radius for a sphere that bulges towards the hand [1/m]. */
  readonly curvature: number;
  readonly c_ii: number;
  readonly own_force: Vec3;
  readonly u_others: Vec3;
}

/** Evaluate the surface at a probe [m]. */
export function look(surface: LocalSurface, probe: Vec3): Sight {
  return {
    depth: depthOf(surface, probe),
    normal: normalAt(surface, probe),
    c_ii: surface.c_ii,
    own_force: surface.own_force,
    u_others: surface.u_others,
  };
}

/** Distance of a probe below the surface [m]; negative outside. Written so that curvature 0 gives the plane. */
export function depthOf(surface: LocalSurface, probe: Vec3): number {
  const out = sub(probe, surface.x_free);
  const height = dot(out, surface.normal);
  const c = surface.curvature;
  if (c === 0) return -height;
  // |out + normal / c| = s / c with s^2 = 1 + 2 c height + c^2 |out|^2
  const s = Math.sqrt(Math.max(0, 1 + 2 * c * height + c * c * dot(out, out)));
  // (1 - s) / c without cancellation as c -> 0
  return -(2 * height + c * dot(out, out)) / (1 + s);
}

/** Outward normal of the local surface at the foot of a probe. */
export function normalAt(surface: LocalSurface, probe: Vec3): Vec3 {
  const c = surface.curvature;
  const n = surface.normal;
  if (c === 0) return n;
  const radial = sub(probe, surface.x_free);
  return unit([n[0] + c * radial[0], n[1] + c * radial[1], n[2] + c * radial[2]], n);
}

/** Interpolate between the sights a (s = 0) and b (s = 1), for a transition between surfaces without a step. */
export function blend(a: Sight, b: Sight, s: number): Sight {
  if (s >= 1) return b;
  if (s <= 0) return a;
  return {
    depth: a.depth + s * (b.depth - a.depth),
    normal: unit(lerp(a.normal, b.normal, s), b.normal),
    c_ii: a.c_ii + s * (b.c_ii - a.c_ii),
    own_force: lerp(a.own_force, b.own_force, s),
    u_others: lerp(a.u_others, b.u_others, s),
  };
}

/** A sight moved by a difference of sights (`difference`); null leaves it as it is. */
export function shift(sight: Sight, by: Sight | null): Sight {
  if (by === null) return sight;
  const n = sight.normal;
  const d = by.normal;
  return {
    depth: sight.depth + by.depth,
    normal: unit([n[0] + d[0], n[1] + d[1], n[2] + d[2]], n),
    c_ii: sight.c_ii + by.c_ii,
    own_force: add(sight.own_force, by.own_force),
    u_others: add(sight.u_others, by.u_others),
  };
}

/** The sight to be added to b to get a; its normal is a difference of normals. */
export function difference(a: Sight, b: Sight): Sight {
  return {
    depth: a.depth - b.depth,
    normal: sub(a.normal, b.normal),
    c_ii: a.c_ii - b.c_ii,
    own_force: sub(a.own_force, b.own_force),
    u_others: sub(a.u_others, b.u_others),
  };
}
