/**
 * The effect of delay on a hand: its true position, and its position for everybody else.
 *
 * The server, and so everybody who sees or feels a hand, has the hand at its newest sample, half a loop old. The own loop
 * knows its own tip exactly, now and in the last minute. The present position of other hands is not known here, but that at
 * an earlier moment is, from the sample that came half a loop later. Live there is therefore one pair of positions, that of
 * the own hand, and in a replay there is a pair for each hand.
 */

import type { TouchState } from "../model/hand";
import type { SceneSnapshot, UserState } from "../model/scene";
import { norm, sub, type Vec3 } from "../model/vec";

export interface Ghost {
  readonly user: number;
  /** Position of the hand's tip for everybody else [m]. */
  readonly arrived: Vec3;
  /** True position of the tip at that moment [m]. */
  readonly itself: Vec3;
  readonly normal: Vec3;
  /** Time by which the position arrives late [s]. */
  readonly late: number;
  /** Distance between the two positions [m]. */
  readonly apart: number;
}

/** Position at which a hand's tip is drawn. */
export type TipOf = (user: UserState) => Vec3;

function ghost(user: UserState, arrived: Vec3, itself: Vec3, late: number): Ghost {
  return { user: user.user, arrived, itself, normal: user.normal, late, apart: norm(sub(itself, arrived)) };
}

/**
 * The pair of the own hand now; none before the hand is in the scene.
 *
 * @param own Report of the own loop; `tip` is the tip's position by that loop [m].
 * @param now Time on the page's clock [s].
 */
export function ghostsNow(view: SceneSnapshot, own: TouchState | null, tip: Vec3, now: number, tipOf: TipOf): readonly Ghost[] {
  const heard = own === null || own.phase !== "joined" || own.user === 0 ? undefined : view.users.find(({ user }) => user === own.user);
  if (own === null || heard === undefined || !heard.fresh) return [];
  const shown = now + own.clock_offset - view.t_server; // the picture's age
  return [ghost(heard, tipOf(heard), tip, Math.max(0, shown) + 0.5 * own.round_trip)];
}

/**
 * The pairs of all hands at a time of a recording, as far as later samples give the true positions.
 *
 * @param hand Returns a hand at a time, as it arrived; null where that is not known.
 * @param own Number of the own hand; `track` returns its tip by its own loop.
 */
export function ghostsThen(
  users: readonly UserState[], t: number, hand: (user: number, t: number) => UserState | null, own: number, track: (t: number) => Vec3 | null, tipOf: TipOf,
): readonly Ghost[] {
  return users.flatMap((user) => {
    if (!user.fresh || !(user.loop_delay > 0)) return [];
    const late = 0.5 * user.loop_delay;
    const later = hand(user.user, t + late);
    const itself = (user.user === own ? track(t) : null) ?? (later === null ? null : tipOf(later));
    return itself === null ? [] : [ghost(user, tipOf(user), itself, late)];
  });
}
