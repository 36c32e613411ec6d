/** Interpolation between two frames, as pure functions of time. */

import type { RoomLag } from "../model/body";
import { lerp, unit, type Vec3 } from "../model/vec";
import type { UserRecord } from "../protocol/scene";

/** A frame of the scene with its surface. */
export interface Frame {
  /** Time on the server's clock [s]. */
  readonly t_server: number;
  readonly users: readonly UserRecord[];
  readonly room: RoomLag;
  /** Displacement from rest, shape (n, 3) [m]; that of the previous frame if nothing newer is known. */
  readonly displacement: Float32Array;
}

/** Two frames and the share of the second; the same frame twice if there is nothing to interpolate. */
export interface Between {
  readonly a: Frame;
  readonly b: Frame;
  /** Share of the second frame, 0 to 1. */
  readonly share: number;
}

/**
 * Position of a time among frames; null without frames.
 *
 * A frame holds until shortly before the next one: the server sends none while nothing changes.
 *
 * @param frames Frames, rising in time.
 * @param longest Longest transition to a frame before its time [s].
 */
export function between(frames: readonly Frame[], t: number, longest: number): Between | null {
  const last = frames.at(-1);
  if (last === undefined) return null;
  if (t >= last.t_server) return { a: last, b: last, share: 1 };
  for (let i = frames.length - 1; i > 0; i -= 1) {
    const [a, b] = [frames[i - 1], frames[i]];
    if (a === undefined || b === undefined || t < a.t_server) continue;
    const from = Math.max(a.t_server, b.t_server - longest);
    const way = b.t_server - from;
    return { a, b, share: way > 0 ? Math.max(0, (t - from) / way) : 1 };
  }
  const [first] = frames;
  return first === undefined ? null : { a: first, b: first, share: 1 };
}

/** positions = rest + displacement, straight from a to b; shape (n, 3) [m]. */
export function place(positions: Float32Array, rest: Float32Array, { a, b, share }: Between): void {
  const [from, to] = [a.displacement, b.displacement];
  for (let i = 0; i < positions.length; i += 1) {
    const u = from[i] ?? 0;
    positions[i] = (rest[i] ?? 0) + u + share * ((to[i] ?? 0) - u);
  }
}

/** Users between a and b: one who comes or goes does so at b's time; fields that cannot be interpolated are b's. */
export function usersBetween({ a, b, share }: Between): readonly UserRecord[] {
  if (share >= 1) return b.users;
  return a.users.map((from) => {
    const to = b.users.find(({ user }) => user === from.user);
    return to === undefined ? from : mix(from, to, share);
  });
}

function mix(a: UserRecord, b: UserRecord, s: number): UserRecord {
  const line = (from: number, to: number): number => from + s * (to - from);
  const normal: Vec3 = unit(lerp(a.normal, b.normal, s), b.normal);
  return {
    ...b,
    probe: lerp(a.probe, b.probe, s),
    foot: lerp(a.foot, b.foot, s),
    x_free: lerp(a.x_free, b.x_free, s),
    force: lerp(a.force, b.force, s),
    normal,
    curvature: line(a.curvature, b.curvature),
    presence: line(a.presence, b.presence),
    c_ii: line(a.c_ii, b.c_ii),
    k_o_coupled: line(a.k_o_coupled, b.k_o_coupled),
    k_h: line(a.k_h, b.k_h),
  };
}
