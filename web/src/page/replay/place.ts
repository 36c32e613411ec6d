/** The replay's place on the page: frames are kept from the beginning, but the replay's code is loaded when it is first used. */

import type { TouchState } from "../../model/hand";
import type { Recording } from "../../model/recording";
import type { SceneSnapshot } from "../../model/scene";
import { OwnTrack } from "../../replay/own_track";
import type { Lens } from "../../ui/cards/column";
import { el } from "../../ui/dom";
import { lazily } from "../../ui/lazy";
import { tipOfOwn } from "../../view/pose";
import type { Around, ReplayRunner } from "./runner";

const MOST_WISHES = 8; // more key presses than anybody makes while a few kilobytes are loaded

export class ReplayPlace {
  readonly root = el("div", { class: "replay-place" });
  private readonly track = new OwnTrack();
  private runner: ReplayRunner | null = null;
  /** Wishes of the visitor while the runner was being loaded. */
  private wishes: ((runner: ReplayRunner) => void)[] = [];
  private readonly load = lazily(() => import("./runner"), ({ ReplayRunner }) => {
    this.runner = new ReplayRunner(this.around, this.track, this.root);
    for (const wish of this.wishes.splice(0)) wish(this.runner);
  }, () => { this.wishes = []; });

  constructor(private readonly around: Around) {}

  /** Whether a past time is shown. */
  get active(): boolean {
    return this.runner?.active === true;
  }

  /** Recording that is shown in place of the present body; null for none. */
  get recording(): Recording | null {
    return this.runner?.recording ?? null;
  }

  get lens(): Lens | null {
    return this.runner?.lens ?? null;
  }

  /** Words of the top line on the replay; empty for none. */
  get words(): string {
    return this.lens === null ? "" : `replay, ${this.lens.when}`;
  }

  /** Height of the bar that covers the foot of the stage [px]. */
  get height(): number {
    return this.runner?.height ?? 0;
  }

  /** Show or hide the bar. */
  toggle(): void {
    this.with((runner) => { runner.toggle(); });
  }

  /** Switch between live and a paused replay. */
  look(): void {
    this.with((runner) => { runner.look(); });
  }

  delay(): void {
    this.with((runner) => { runner.delay(); });
  }

  /** Go back to live, and hide the bar. */
  close(): void {
    this.runner?.close();
  }

  /** @returns Whether the key belongs to the replay. */
  key(event: KeyboardEvent): boolean {
    return this.runner?.key(event) === true;
  }

  /** Scene to show at `now`: the live one, or that of the replay. */
  frame(view: SceneSnapshot | null, own: TouchState | null, now: number, dt: number): SceneSnapshot | null {
    // The offset of the clocks is not known before the first round trip.
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
    this.load();
  }
}
