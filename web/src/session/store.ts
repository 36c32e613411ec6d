/** The page's scene where it shows a recorded session: nobody is here, and nothing is live. */

import type { RestMesh } from "../model/body";
import { NO_RESTRAINTS } from "../model/orders";
import { quadratureOf } from "../model/quadrature";
import type { RecordedSession, Recording } from "../model/recording";
import type { CompanyLink } from "../model/company";
import type { SceneSnapshot, SceneStore, UserHistory, WatchInfo, WatchStatus } from "../model/scene";
import { GreenBlocks, type Fetch } from "../watch/green_blocks";
import { displacementOf, needed, pressesOf } from "../watch/green_surface";
import type { Overview } from "./overview";
import { type FetchScenes, type Scenes, Stretches } from "./stretches";

const NOTHING = (): void => undefined;
const NOBODY: CompanyLink = { state: null, aimed: null, marks: [], declined: null, present: NOTHING, follow: NOTHING, aim: NOTHING, point: NOTHING };
const STATUS: WatchStatus = {
  phase: "watching", reason: "", code: 0, retry_at: 0, silent: 0, frames: 0, bytes: 0, frames_per_second: 0, bytes_per_second: 0,
  playout_delay: 0, encoding: "forces", blocks: 0, blocks_missing: 0,
};

/** Where the parts of the session come from. */
export interface Source {
  readonly scenes: FetchScenes;
  /** Green's functions of a model. */
  readonly green: (model: string) => Fetch;
  /** Time on the page's clock [s]. */
  readonly now: () => number;
}

export class SessionStore implements SceneStore, RecordedSession {
  readonly file = this;
  readonly info: WatchInfo;
  readonly events = [];
  readonly restraints = NO_RESTRAINTS;
  readonly putOut = [];
  readonly onRecord = false;
  readonly company = NOBODY;
  readonly roster = [];
  readonly status = STATUS;
  readonly subscribe = (): (() => void) => NOTHING;
  wanted: number | null = null;
  private readonly stretches: Stretches;
  private readonly surface: Recording["surface"];
  private readonly parts = new WeakMap<Scenes, Recording>();

  /** @param start Time at which the replay begins [s]. */
  constructor(private readonly overview: Overview, readonly mesh: RestMesh, source: Source, readonly start: number) {
    this.info = overview.watching;
    this.stretches = new Stretches(overview.first, overview.last, source.scenes, source.now);
    this.surface = this.info.model === null ? null : surfaceOf(mesh, this.info.body.contact_radius, source.green(this.info.model), source.now);
  }

  get name(): string {
    return this.overview.name;
  }
  get first(): number {
    return this.overview.first;
  }
  get last(): number {
    return this.overview.last;
  }
  get moments(): RecordedSession["moments"] {
    return this.overview.moments;
  }
  get trouble(): string {
    return this.stretches.trouble;
  }

  has(t: number): boolean {
    return this.stretches.has(t);
  }

  /** Why the deformation at a time is not shown, in a sentence; empty if it is, or the scenes have not come. */
  unshown(t: number): string {
    return this.has(t) && !this.stretches.round(t).surfaces ? this.overview.unshown : "";
  }

  round(t: number, speed: number): Recording {
    this.stretches.want(t, speed);
    const scenes = this.stretches.round(t);
    const known = this.parts.get(scenes);
    if (known !== undefined) return known;
    const { mesh, info, surface, overview: { names } } = this;
    const made = { mesh, info, surface, names, times: scenes.times, frames: scenes.frames, interval: intervalOf(scenes.times, info.simulation_period) };
    this.parts.set(scenes, made);
    return made;
  }

  recorded(): Recording {
    return this.round(this.start, 1);
  }

  at(): SceneSnapshot | null {
    return null;
  }
  history(): UserHistory | null {
    return null;
  }
  setView(): void { /* a file is as it is */ }
  setLatency(): void { /* nobody is here */ }
  order(): void { /* nobody is here */ }
  close(): void { /* no connection is open */ }
}

/** Time between two scenes in the middle, since a recording may have fewer than one in each tick [s]. */
export function intervalOf(times: Float64Array, period: number): number {
  const gaps = times.slice(1).map((t, i) => t - (times[i] ?? t)).sort();
  return Math.max(period, gaps[gaps.length >> 1] ?? 0);
}

function surfaceOf(mesh: RestMesh, radius: number, fetch: Fetch, now: () => number): NonNullable<Recording["surface"]> {
  const vertices = mesh.vertices.length / 3;
  const blocks = new GreenBlocks(vertices, fetch, now, NOTHING);
  let made: ReturnType<typeof quadratureOf> | null = null;
  return (loads) => {
    const presses = pressesOf(loads, () => (made ??= quadratureOf(mesh)), radius);
    return blocks.ask(needed(presses)) ? displacementOf(presses, blocks.get, vertices) : null;
  };
}
