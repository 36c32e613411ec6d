/** The received frames, and the scene at any time between them. */

import type { RestMesh } from "../model/body";
import type { SceneSnapshot, UserState } from "../model/scene";
import type { Scene } from "../protocol/scene";
import { type Between, between, type Frame, place, usersBetween } from "./interpolation";
import { firstFrame, nextFrame, playoutDelay, type PlayoutClock } from "./playout_clock";
import type { Room } from "./room";

const KEPT = 1; // s of frames behind the time that is shown
/** Longest transition to a frame, in frame intervals. */
export const GAP = 2;

/** Newest frames of one connection. */
export class FrameBuffer {
  private frames: Frame[] = [];
  private clock: PlayoutClock | null = null;
  private readonly positions: Float32Array;
  private drawn: Between | null = null;

  /** @param interval Time between frames [s]; may change. */
  constructor(
    private readonly mesh: RestMesh,
    public interval: number,
  ) {
    this.positions = Float32Array.from(mesh.vertices);
  }

  get playoutDelay(): number {
    return this.clock === null ? 0 : playoutDelay(this.clock);
  }

  /**
   * Take a frame that came.
   *
   * @param displacement Displacement of the surface, shape (n, 3) [m]; null for that of the previous frame.
   */
  take(scene: Scene, displacement: Float32Array | null, now: number): void {
    const { t_server, users, room } = scene;
    this.clock =
      this.clock === null
        ? firstFrame(t_server, now, this.interval)
        : nextFrame(this.clock, t_server, now, this.interval);
    const surface = displacement ?? this.frames.at(-1)?.displacement ?? new Float32Array(this.positions.length);
    const shown = now - this.clock.lag;
    // The last frame before the shown time is kept however old it is, because it holds until the next frame.
    const old = this.frames.findLastIndex((frame) => frame.t_server <= shown - KEPT);
    this.frames = [...this.frames.slice(Math.max(0, old)), { t_server, users, room, displacement: surface }];
  }

  /** Set the surface of the newest frame, which came without one. */
  amend(displacement: Float32Array): void {
    const newest = this.frames.pop();
    if (newest !== undefined) this.frames.push({ ...newest, displacement });
  }

  /** The scene at `now`; null before the first frame. */
  at(now: number, room: Room): SceneSnapshot | null {
    if (this.clock === null) return null;
    const t_server = now - this.clock.lag;
    const pair = between(this.frames, t_server, GAP * this.interval);
    if (pair === null) return null;
    const moved = !sameSurface(this.drawn, pair);
    if (moved) place(this.positions, this.mesh.vertices, pair);
    this.drawn = pair;
    const users: UserState[] = usersBetween(pair)
      .map((record) => ({ ...record, name: room.nameOf(record.user), latency: room.latencyOf(record.user), rules: room.rulesOf(record.user) }))
      .sort((a, b) => a.user - b.user);
    return { t_server, positions: this.positions, moved, users, room: pair.b.room };
  }
}

function sameSurface(before: Between | null, now: Between): boolean {
  if (before === null) return false;
  const still = now.a.displacement === now.b.displacement;
  if (still) return shownAlone(before) === now.b.displacement;
  return (
    before.a.displacement === now.a.displacement &&
    before.b.displacement === now.b.displacement &&
    before.share === now.share
  );
}

/** Surface that is shown unmixed; null if two surfaces are mixed. */
function shownAlone({ a, b, share }: Between): Float32Array | null {
  if (share >= 1 || a.displacement === b.displacement) return b.displacement;
  return share <= 0 ? a.displacement : null;
}
