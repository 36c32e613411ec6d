/** The replay's place on the page: what came is remembered from the beginning, the rest comes over the network when it is asked for. */

import type { TouchState } from "../../model/hand";
import type { Recording } from "../../model/recording";
import type { SceneSnapshot } from "../../model/scene";
import { OwnTrack } from "../../replay/own_track";
import type { Lens } from "../../ui/cards/panel";
import { el } from "../../ui/dom";
import { tipOfOwn } from "../../view/pose";
import type { Around, ReplayRunner } from "./runner";

const MOST_WISHES = 8; // more presses of keys than anybody makes while a few kilobytes come

export class ReplayPlace {
  readonly root = el("div", { class: "replay-place" });
  private readonly track = new OwnTrack();
  private runner: ReplayRunner | null = null;
  private loading = false;
  /** What was asked for while the runner was on its way. */
  private wishes: ((runner: ReplayRunner) => void)[] = [];

  constructor(private readonly around: Around) {}

  /** Whether a time of before is shown. */
  get active(): boolean {
    return this.runner?.active === true;
  }

  /** What is shown in place of the body of now; null for nothing. */
  get recording(): Recording | null {
    return this.runner?.recording ?? null;
  }

  get lens(): Lens | null {
    return this.runner?.lens ?? null;
  }

  /** What the line on top says of it; empty for nothing. */
  get words(): string {
    return this.lens === null ? "" : `replay, ${this.lens.when}`;
  }

  /** Of the bar that covers the foot of the stage [px]. */
  get height(): number {
    return this.runner?.height ?? 0;
  }

  /** The bar, or none. */
  toggle(): void {
    this.with((runner) => { runner.toggle(); });
  }

  /** From live to a replay that stands, and back. */
  look(): void {
    this.with((runner) => { runner.look(); });
  }

  delay(): void {
    this.with((runner) => { runner.delay(); });
  }

  /** Back to live, and no bar. */
  close(): void {
    this.runner?.close();
  }

  /** @returns Whether the key was one of the replay's. */
  key(event: KeyboardEvent): boolean {
    return this.runner?.key(event) === true;
  }

  /** What is to be shown at `now`. */
  frame(view: SceneSnapshot | null, own: TouchState | null, now: number, dt: number): SceneSnapshot | null {
    // Before the first round trip the clocks are not known of each other.
    if (own !== null && own.phase === "joined" && own.round_trip > 0) this.track.push(own.t + own.clock_offset, tipOfOwn(own));
    return this.runner === null ? view : this.runner.frame(view, own, now, dt);
  }

  update(now: number): void {
    this.runner?.update(now);
  }

  private with(act: (runner: ReplayRunner) => void): void {
    if (this.runner !== null) {
      act(this.runner);
      return;
    }
    if (this.wishes.length < MOST_WISHES) this.wishes.push(act);
    if (this.loading) return;
    this.loading = true;
    import("./runner").then(({ ReplayRunner }) => {
      this.runner = new ReplayRunner(this.around, this.track, this.root);
      for (const wish of this.wishes.splice(0)) wish(this.runner);
    }, () => {
      this.wishes = [];
      this.loading = false; // to be asked for again
    });
  }
}
