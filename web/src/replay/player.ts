/** The scene of a recording at any of its times: a pure function of both, apart from a cache. */

import type { Recording } from "../model/recording";
import { NO_WORD, type SceneSnapshot, type UserState } from "../model/scene";
import { decodeScene, decodeUsers, type UserRecord } from "../protocol/scene";
import { type Traversal, traversalOf } from "../protocol/traversal";
import { GAP } from "../watch/frame_buffer";
import { between, type Frame, place, usersBetween } from "../watch/interpolation";
import { lastBefore } from "./scrubber";

const NEAR = 6; // frames whose surfaces are kept in the cache
const NO_LATENCY = { delay: 0, jitter: 0, network: "" }; // an added latency is part of the measured delay

export interface Shown extends SceneSnapshot {
  /** Whether the server was heard at that time; during a silence the scene is that from before. */
  readonly known: boolean;
  /** Whether the surface is that of this time; otherwise its Green's functions are still being loaded. */
  readonly complete: boolean;
}

interface Made extends Frame {
  readonly complete: boolean;
}

export class Player {
  private readonly near = new Map<number, Made>(); // least recently used first
  private readonly records: (readonly UserRecord[] | undefined)[] = [];
  private readonly positions: Float32Array;
  private drawn = "";
  private found: Traversal | null = null;

  constructor(readonly recording: Recording) {
    this.positions = Float32Array.from(recording.mesh.vertices);
  }

  get times(): Float64Array {
    return this.recording.times;
  }

  at(t: number): Shown {
    const i = Math.max(0, lastBefore(this.times, t));
    const [a, b] = [this.frame(i), this.frame(Math.min(i + 1, this.times.length - 1))];
    const pair = between(a === b ? [a] : [a, b], t, GAP * this.recording.interval) ?? { a, b, share: 0 };
    const complete = a.complete && b.complete;
    const key = `${i} ${pair.share} ${complete}`;
    // More of an incomplete surface may have come since the last call.
    const moved = key !== this.drawn || !complete;
    if (moved) place(this.positions, this.recording.mesh.vertices, pair);
    this.drawn = key;
    const users = usersBetween(pair).map((record) => this.named(record)).sort((p, q) => p.user - q.user);
    return { t_server: t, positions: this.positions, moved, users, room: pair.b.room, known: this.known(t), complete };
  }

  /** Whether the server was heard at that time. */
  known(t: number): boolean {
    const i = lastBefore(this.times, t);
    return i >= 0 && t - (this.times[i] ?? -Infinity) < NO_WORD;
  }

  /** A hand at a time, without computing the surface; null where the hand is not known. */
  hand(user: number, t: number): UserState | null {
    const i = lastBefore(this.times, t);
    if (i < 0 || !this.known(t)) return null;
    const [a, b] = [this.usersOf(i), this.usersOf(Math.min(i + 1, this.times.length - 1))];
    const [from, to] = [this.times[i] ?? t, this.times[i + 1] ?? t];
    const frame = (t_server: number, users: readonly UserRecord[]): Frame => ({ t_server, users, room: NOWHERE, displacement: NOTHING });
    const pair = between([frame(from, a), frame(Math.max(from, to), b)], t, GAP * this.recording.interval);
    const record = pair === null ? undefined : usersBetween(pair).find((one) => one.user === user);
    return record === undefined ? null : this.named(record);
  }

  /** The users of a frame. */
  usersOf(i: number): readonly UserRecord[] {
    const bytes = this.recording.frames[i];
    return (this.records[i] ??= bytes === undefined ? [] : decodeUsers(bytes));
  }

  private named(record: UserRecord): UserState {
    return { ...record, name: this.recording.names.get(record.user) ?? "", latency: NO_LATENCY, rules: null };
  }

  private frame(i: number): Made {
    const kept = this.near.get(i);
    this.near.delete(i);
    const made = kept?.complete === true ? kept : this.make(i);
    this.near.set(i, made);
    for (const oldest of this.near.keys()) {
      if (this.near.size <= NEAR) break;
      this.near.delete(oldest);
    }
    return made;
  }

  private make(i: number): Made {
    const bytes = this.recording.frames[i];
    const { mesh, surface } = this.recording;
    if (bytes === undefined) return { t_server: 0, users: [], room: NOWHERE, displacement: new Float32Array(mesh.vertices.length), complete: true };
    const scene = decodeScene(bytes, () => (this.found ??= traversalOf(mesh.vertices.length / 3, mesh.faces)));
    const { t_server, users, room } = scene;
    if (scene.surface !== null) {
      const { scale, units } = scene.surface;
      return { t_server, users, room, displacement: Float32Array.from(units, (u) => scale * u), complete: true };
    }
    const made = surface?.(users) ?? null;
    if (made !== null) return { t_server, users, room, displacement: made, complete: true };
    // The former surface: a sign of life means that nothing moved, and an old surface is better than a flat one.
    const before = this.before(i);
    const displacement = before?.displacement ?? new Float32Array(mesh.vertices.length);
    return { t_server, users, room, displacement, complete: surface === null };
  }

  /** The newest earlier frame that has a surface of its own or is in the cache. */
  private before(i: number): Made | undefined {
    for (let k = i - 1; k >= 0; k -= 1) {
      const kept = this.near.get(k);
      if (kept !== undefined) return kept;
      if (this.recording.surface === null && hasSurface(this.recording.frames[k])) return this.make(k);
    }
    return undefined;
  }
}

const NOWHERE = { lag: 0, coupling: 0, margin: 0 };
const NOTHING = new Float32Array();

/** Whether a frame brings the surface, by its flags (docs/protocol.md). */
function hasSurface(frame: Uint8Array | undefined): boolean {
  return (frame?.[2] ?? 0) !== 0;
}
