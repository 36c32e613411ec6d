/** The tour goes on when a step is complete, names the steps it skips, and never hangs. */

import { describe, expect, it } from "vitest";
import {
  type Action,
  again,
  type Facts,
  goBack,
  goNext,
  pause,
  place,
  readingTime,
  start,
  tick,
  type TourState,
  waits,
} from "../../src/tour/machine";
import { OCEAN, SLOW, STEPS } from "../../src/tour/steps";

const ALL: Facts = {
  others: 2, coming: false, allowFixedGains: true, touching: true, force: 2, fromOthers: 0.5, lag: 0.01,
  loopDelay: 2.2 * OCEAN, law: "predictive", paper: false, swing: { size: 0.001, hz: 0 }, rehearsed: { size: 3, hz: 1.7 },
};

const stepOf = (state: TourState): string => STEPS[state.index]?.id ?? "";

/** Run with facts that depend on the step; returns the steps that were seen and all that was done. */
function run(factsAt: (step: string) => Facts, most = 3600): { seen: string[]; done: Action[]; last: TourState } {
  let { state, actions } = start(STEPS, factsAt(""), 0);
  const seen = [stepOf(state)];
  const done = [...actions];
  for (let now = 0; now < most && seen.at(-1) !== "yours"; now += 0.1) {
    ({ state, actions } = tick(STEPS, state, factsAt(stepOf(state)), now));
    done.push(...actions);
    if (stepOf(state) !== seen.at(-1)) seen.push(stepOf(state));
  }
  return { seen, done, last: state };
}

/** The live system in each step. */
const live = (step: string): Facts => {
  if (step === "paper" || step === "coupled") return { ...ALL, paper: true, law: "proportional", lag: 2 * SLOW };
  if (step === "soft") return { ...ALL, law: "proportional" };
  return ALL;
};

describe("the tour", () => {
  it("goes through every step by itself on a server that allows everything", () => {
    const { seen, last } = run(live);
    expect(seen).toEqual(STEPS.map((step) => step.id));
    expect(last.ended).toBe(false);
    expect(goNext(STEPS, last, ALL, 0).state.ended).toBe(true);
  });

  it("shows a step again that nobody saw, with all that it does, and none after its end", () => {
    const at = goNext(STEPS, start(STEPS, ALL, 0).state, ALL, 0);
    expect(stepOf(at.state)).toBe("press");
    const late = tick(STEPS, at.state, ALL, 9).state;
    const turn = again(STEPS, late, ALL, 60);
    expect(turn.actions).toEqual(at.actions);
    expect(turn.state).toEqual({ ...at.state, since: 60 });
    const over = { ...late, ended: true };
    expect(again(STEPS, over, ALL, 60)).toEqual({ state: over, actions: [] });
  });

  it("gives time to read", () => {
    const first = STEPS[0];
    if (first === undefined) throw new Error("a tour has steps");
    const { state } = start(STEPS, ALL, 0);
    expect(tick(STEPS, state, ALL, readingTime(first) - 0.1).state.index).toBe(0);
    expect(tick(STEPS, state, ALL, readingTime(first) + 0.1).state.index).toBe(1);
  });

  it("waits for its condition, which has to hold and not only flash", () => {
    const still = { ...ALL, force: 0 };
    const at = goNext(STEPS, start(STEPS, ALL, 0).state, ALL, 0).state;
    expect(stepOf(at)).toBe("press");
    let state = tick(STEPS, at, still, 20).state;
    expect(stepOf(state)).toBe("press");
    expect(waits(STEPS, state)).toBe(true);
    state = tick(STEPS, state, ALL, 20.5).state;
    expect(stepOf(state)).toBe("press");
    state = tick(STEPS, state, still, 20.8).state;
    expect(state.heldSince).toBeNull();
    state = tick(STEPS, state, ALL, 21).state;
    expect(stepOf(tick(STEPS, state, ALL, 22.1).state)).toBe("feel");
  });

  it("goes on without, when nothing comes", () => {
    const { seen } = run(() => ({ ...ALL, touching: false, force: 0, fromOthers: 0, lag: 0, loopDelay: 0, law: null }));
    expect(seen.at(-1)).toBe("yours");
    expect(seen).toContain("paper");
  });

  it("skips the steps that the server does not allow, with a sentence", () => {
    const strict = { ...ALL, allowFixedGains: false };
    let { state } = start(STEPS, strict, 0);
    while (stepOf(state) !== "ocean") state = goNext(STEPS, state, strict, 0).state;
    expect(state.skipped).toEqual([]); // a delay is the page's own
    state = goNext(STEPS, state, strict, 0).state;
    expect(stepOf(state)).toBe("soft");
    expect(state.skipped.join(" ")).toContain("--allow-fixed-gains");
    expect(new Set(state.skipped).size).toBe(state.skipped.length);
  });

  it("says that nobody else is here", () => {
    const { seen } = run(() => ({ ...ALL, others: 0 }));
    expect(seen).not.toContain("feel");
    expect(seen).not.toContain("paper");
    expect(seen).toContain("ocean");
  });

  it("leaves nothing out for want of a partner who is on the way in", () => {
    const early = { ...ALL, others: 0, coming: true, fromOthers: 0 };
    const state = goNext(STEPS, goNext(STEPS, start(STEPS, early, 0).state, early, 1).state, early, 2).state;
    expect(stepOf(state)).toBe("feel");
    expect(state.skipped).toEqual([]);
    expect(waits(STEPS, tick(STEPS, state, early, 3).state)).toBe(true);
  });

  it("goes back over skipped steps, and not before the beginning", () => {
    const strict = { ...ALL, allowFixedGains: false };
    let { state } = start(STEPS, strict, 0);
    while (stepOf(state) !== "soft") state = goNext(STEPS, state, strict, 0).state;
    expect(stepOf(goBack(STEPS, state, strict, 0).state)).toBe("ocean");
    // Nor to what was shown and cannot be any more.
    const alone = { ...strict, others: 0 };
    while (stepOf(state) !== "sheet") state = goBack(STEPS, state, strict, 0).state;
    expect(stepOf(goBack(STEPS, state, alone, 0).state)).toBe("press");
    expect(goBack(STEPS, start(STEPS, ALL, 0).state, ALL, 0).state.index).toBe(0);
  });

  it.each([
    ["everything", ALL, 10],
    ["no gains of one's own", { ...ALL, allowFixedGains: false }, 8],
    ["nobody else", { ...ALL, others: 0 }, 7],
  ])("counts the steps that it shows: %s", (_, facts, all) => {
    let { state } = start(STEPS, facts, 0);
    for (let n = 1; n <= all; n += 1) {
      expect(place(STEPS, state, facts)).toEqual([n, all]);
      if (n < all) state = goNext(STEPS, state, facts, 0).state;
    }
    expect(stepOf(state)).toBe("yours");
    state = goBack(STEPS, state, facts, 0).state;
    expect(place(STEPS, state, facts)).toEqual([all - 1, all]);
    expect(place(STEPS, again(STEPS, state, facts, 1).state, facts)).toEqual([all - 1, all]);
  });

  it("counts what it has shown also where it could not show it any more, and no longer what cannot come", () => {
    let { state } = start(STEPS, ALL, 0);
    while (stepOf(state) !== "sheet") state = goNext(STEPS, state, ALL, 0).state;
    expect(place(STEPS, state, ALL)).toEqual([4, 10]);
    expect(place(STEPS, state, { ...ALL, others: 0 })).toEqual([4, 8]);
  });

  it("says nothing that was not measured, or that the server did not allow", () => {
    const text = (id: string): string => STEPS.find((step) => step.id === id)?.text ?? "";
    // Shown also where no delay was added, and where no law was another one before.
    expect(text("ours")).not.toMatch(/ocean|returns/);
    // Hands that hardly couple are stable by the rule for one as well: whether they swing, the claim says.
    expect(text("coupled")).not.toMatch(/it is outside|your gain is inside/);
    expect(text("paper")).not.toMatch(/now has to/);
    const claim = STEPS.find((step) => step.id === "paper")?.claim;
    expect(claim?.({ ...ALL, lag: 0.12 })).toBe("The object takes its time: it answers the others in 0.12 s now.");
    expect(claim?.({ ...ALL, lag: 0.03 })).toBe("Here it does not take long: it answers the others in 0.03 s.");
    expect(claim?.({ ...ALL, lag: 0 })).toBe("Here it does not: it answers the others at once.");
    // Just after the law has changed the lag may still rise.
    expect(claim?.({ ...ALL, lag: 0, swing: null })).toBe("");
  });

  it("stands while it is paused", () => {
    const held = pause(tick(STEPS, start(STEPS, ALL, 0).state, ALL, 0).state, true);
    expect(tick(STEPS, held, ALL, 999).state.index).toBe(0);
  });

  it("puts everything back: the law, the delay, the hand", () => {
    const { done } = run(live);
    const of = (kind: Action["kind"]): Action[] => done.filter((action) => action.kind === kind);
    expect(of("law").at(-1)).toEqual({ kind: "law", law: "predictive" });
    expect(of("delay").at(-1)).toEqual({ kind: "delay", delay: 0 });
    expect(of("measure").at(-1)).toEqual({ kind: "measure", by: "coupled" });
    expect(of("lift")).toHaveLength(1);
    expect(of("hold").at(-1)).toEqual({ kind: "hold", grip: "natural" });
  });
});
