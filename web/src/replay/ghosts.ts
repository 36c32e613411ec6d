/**
 * What delay does to a hand: where it is itself, and where it is for everybody else.
 *
 * The server, and so everybody who sees or feels a hand, has it as its newest sample said: half a loop old. The own
 * loop knows better of its own tip, now and in the last minute. Of the hands of others nobody here knows where they
 * are now; of any moment before it is known by now, from what came half a loop later. So live there is one pair, the
 * own one, and in a replay there is one for each hand.
 */

import type { TouchState } from "../model/hand";
import type { SceneSnapshot, UserState } from "../model/scene";
import { norm, sub, type Vec3 } from "../model/vec";

export interface Ghost {
  readonly user: number;
  /** Where everybody else has the hand [m]. */
  readonly arrived: Vec3;
  /** Where it is itself at that moment [m]. */
  readonly itself: Vec3;
  readonly normal: Vec3;
  /** How much later it arrives [s]. */
  readonly late: number;
  /** Between the two [m]. */
  readonly apart: number;
}

/** Where a hand's tip is drawn. */
export type TipOf = (user: UserState) => Vec3;

function ghost(user: UserState, arrived: Vec3, itself: Vec3, late: number): Ghost {
  return { user: user.user, arrived, itself, normal: user.normal, late, apart: norm(sub(itself, arrived)) };
}

/**
 * The own hand, now; none before there is a picture of it.
 *
 * @param own Report of the own loop, and `tip` where that has the tip [m].
 * @param now Page's clock [s].
 */
export function ghostsNow(view: SceneSnapshot, own: TouchState | null, tip: Vec3, now: number, tipOf: TipOf): readonly Ghost[] {
  const heard = own === null || own.phase !== "joined" || own.user === 0 ? undefined : view.users.find(({ user }) => user === own.user);
  if (own === null || heard === undefined || !heard.fresh) return [];
  const shown = now + own.clock_offset - view.t_server; // the picture's age
  return [ghost(heard, tipOf(heard), tip, Math.max(0, shown) + 0.5 * own.round_trip)];
}

/**
 * All hands at a time of a recording, where what came later tells.
 *
 * @param hand A hand at a time, as it arrived; null where that is not known.
 * @param own The number of the own hand, and `track` its tip by its own loop.
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
