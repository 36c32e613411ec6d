/** The state of one hand for drawing: from the scene or, for the own hand, from its own loop. */

import type { TouchState } from "../model/hand";
import type { UserState } from "../model/scene";
import { answersOwnDent } from "../model/laws";
import { along, dot, norm, sub, type Vec3 } from "../model/vec";

export interface Pose {
  readonly user: number;
  readonly name: string;
  readonly own: boolean;
  /** Tip of the device [m]. */
  readonly probe: Vec3;
  /** Position of the tip on the surface; that of the probe if the hand touches nothing [m]. */
  readonly proxy: Vec3;
  readonly normal: Vec3;
  /** Force on the hand [N]. */
  readonly force: Vec3;
  /** Local surface of the hand: a point of it [m]; `curvature` is its curvature [1/m]. */
  readonly x_free: Vec3;
  readonly curvature: number;
  /** Whether there is a local surface. */
  readonly held: boolean;
  /** Opacity of the hand, 0 to 1. */
  readonly presence: number;
}

/** A user as a scene reports it. */
type Told = Omit<UserState, "name" | "latency" | "rules">;

/** Least force that is shown [N]. */
export const LEAST_FORCE = 0.02;

/**
 * Point of the present surface under this hand, x_o = x_free - C_ii f n (docs/protocol.md, patch).
 *
 * A sticking finger moves the surface in all directions. Its law, f = K (depth - the change of depth by that motion),
 * gives its depth below the surface: zero if K is the object's own stiffness.
 */
export function proxyOf(user: Told): Vec3 {
  const pressed = Math.max(0, dot(user.force, user.normal));
  if (user.friction && !answersOwnDent(user.law) && user.k_h > 0) {
    return along(user.probe, pressed * Math.max(0, 1 / user.k_h - user.c_ii), user.normal);
  }
  return along(user.x_free, -user.c_ii * pressed, user.normal);
}

/** Depth of the probe below the surface free of the own force; negative outside [m]. */
export function depthOf(user: Told): number {
  return dot(sub(user.x_free, user.probe), user.normal);
}

export function poseOf(user: UserState): Pose {
  const touches = user.c_ii > 0 && norm(user.force) > LEAST_FORCE;
  return {
    user: user.user,
    name: user.name,
    own: false,
    probe: user.probe,
    proxy: touches ? proxyOf(user) : user.probe,
    normal: user.normal,
    force: user.force,
    x_free: user.x_free,
    curvature: user.geometry === "plane" ? 0 : user.curvature,
    held: user.c_ii > 0,
    presence: user.presence,
  };
}

/** Position at which the own tip is drawn. */
export function tipOfOwn(state: TouchState): Vec3 {
  return norm(state.force) > LEAST_FORCE ? state.proxy : state.probe;
}

/** Pose of the own hand, from its own loop, which is ahead of the server. */
export function ownPose(state: TouchState, heard: UserState | undefined): Pose {
  return {
    user: state.user,
    name: state.name,
    own: true,
    probe: state.probe,
    proxy: tipOfOwn(state),
    normal: state.normal,
    force: state.force,
    x_free: heard?.x_free ?? state.proxy,
    curvature: heard === undefined || heard.geometry === "plane" ? 0 : heard.curvature,
    held: heard !== undefined && heard.c_ii > 0,
    presence: 1,
  };
}
