/** The drawn state of one hand: from the scene or, for the own hand, from the own loop. */

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
  /** Where the tip is held on the surface; the probe where nothing is touched [m]. */
  readonly proxy: Vec3;
  readonly normal: Vec3;
  /** On the hand [N]. */
  readonly force: Vec3;
  /** The surface that the hand holds: a point of it, and its bend [m], [1/m]. */
  readonly x_free: Vec3;
  readonly curvature: number;
  /** Whether there is such a surface. */
  readonly held: boolean;
  /** 0 to 1. */
  readonly presence: number;
}

/** A user as a scene tells of it. */
type Told = Omit<UserState, "name" | "latency">;

/** Below this a force is not shown [N]. */
export const LEAST_FORCE = 0.02;

/**
 * The surface as it is under this hand, x_o = x_free - C_ii f n (docs/protocol.md, patch).
 *
 * A finger that sticks takes the surface with it in all directions, and its law, f = K (depth - the change of depth by
 * that), tells how far it is below the surface: not at all where K is the object's own.
 */
export function proxyOf(user: Told): Vec3 {
  const pressed = Math.max(0, dot(user.force, user.normal));
  if (user.friction && !answersOwnDent(user.law) && user.k_h > 0) {
    return along(user.probe, pressed * Math.max(0, 1 / user.k_h - user.c_ii), user.normal);
  }
  return along(user.x_free, -user.c_ii * pressed, user.normal);
}

/** Of the probe below the surface free of the own force; negative outside [m]. */
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

/** Where the own tip is drawn. */
export function tipOfOwn(state: TouchState): Vec3 {
  return norm(state.force) > LEAST_FORCE ? state.proxy : state.probe;
}

/** The own hand: its loop is ahead of the server. */
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
