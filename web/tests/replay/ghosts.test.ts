import { describe, expect, test } from "vitest";
import type { TouchState } from "../../src/model/hand";
import type { SceneSnapshot, UserState } from "../../src/model/scene";
import { ghostsNow, ghostsThen } from "../../src/replay/ghosts";
import { record } from "../watch/scenes";

/** A hand that moves along x by 1 m/s on the server's clock: what has arrived at t. */
const hand = (user: number, t: number, loop_delay = 0.2): UserState => ({ ...record(user, t), loop_delay, name: "", latency: { delay: 0, jitter: 0, network: "" }, rules: null });
const tipOf = (user: UserState): UserState["probe"] => user.probe;

describe("delay made visible", () => {
  test("of the own hand now is the picture's age and the way there", () => {
    const view = { t_server: 100, users: [hand(1, 100), hand(2, 100)] } as unknown as SceneSnapshot;
    const own = { phase: "joined", user: 1, clock_offset: 90, round_trip: 0.1 } as TouchState;
    const ghosts = ghostsNow(view, own, [100.12, 0, 0], 10.07, tipOf);
    expect(ghosts.map(({ user }) => user)).toEqual([1]);
    expect(ghosts[0]?.late).toBeCloseTo(0.12, 9);
    expect(ghosts[0]?.apart).toBeCloseTo(0.12, 9);
    for (const other of [null, { ...own, phase: "closed" }, { ...own, user: 3 }] as (TouchState | null)[]) {
      expect(ghostsNow(view, other, [0, 0, 0], 10, tipOf)).toEqual([]);
    }
  });

  test("of every hand then is as far as it went in half its loop, and no further", () => {
    for (const loop of [0.02, 0.2, 0.5]) {
      const users = [hand(1, 50, loop), hand(2, 50, loop)];
      const ghosts = ghostsThen(users, 50, (user, t) => hand(user, t, loop), 0, () => null, tipOf);
      expect(ghosts.length).toBe(2);
      for (const { apart, late } of ghosts) {
        expect(late).toBeCloseTo(0.5 * loop, 9);
        expect(apart).toBeCloseTo(late, 9); // at 1 m/s
      }
    }
  });

  test("takes the own loop's word for the own hand, and says nothing of what nobody knows", () => {
    const users = [hand(1, 50), hand(2, 50), { ...hand(3, 50), loop_delay: 0 }, { ...hand(4, 50), fresh: false }];
    const ghosts = ghostsThen(users, 50, () => null, 1, () => [50.3, 0, 0], tipOf);
    expect(ghosts.map(({ user }) => user)).toEqual([1]);
    expect(ghosts[0]?.apart).toBeCloseTo(0.3, 9);
  });
});
