/** Samples of a recording for the plots: some seconds round the shown time, for each hand. */

import type { UserRecord } from "../protocol/scene";
import type { Player } from "./player";
import { lastBefore } from "./scrubber";

/** A piece of the recording's time [s]. */
export interface Window {
  readonly start: number;
  readonly end: number;
}

/** A window of `span` seconds with the shown time in the middle, or as near to the middle as the recording allows. */
export function windowRound(t: number, from: number, to: number, span: number): Window {
  const end = Math.min(Math.max(t + 0.5 * span, Math.min(from + span, to)), Math.max(to, t));
  return { start: end - span, end };
}

/** Takes one sample of a hand. */
export type Take = (user: number, t: number, values: readonly number[]) => void;

/** The samples of all hands in a window, by rising time; samples are computed once and kept. */
export class Samples {
  private readonly kept: (readonly (readonly [number, readonly number[]])[] | undefined)[] = [];

  constructor(private readonly player: Player, private readonly sample: (user: UserRecord) => readonly number[]) {}

  each({ start, end }: Window, take: Take): void {
    const { times } = this.player;
    for (let i = Math.max(0, lastBefore(times, start)); i < times.length; i += 1) {
      const t = times[i] ?? Infinity;
      if (t > end) return;
      const users = (this.kept[i] ??= this.player.usersOf(i).map((user) => [user.user, this.sample(user)] as const));
      for (const [user, values] of users) take(user, t, values);
    }
  }
}
