/** The scene of a recording at any of its times: a pure function of both, apart from a cache. */

import type { Recording } from "../model/recording";
import { NO_WORD, type SceneSnapshot, type UserState } from "../model/scene";
import { ProtocolError } from "../protocol/frame";
import { decodeScene, decodeUsers, type Scene, type UserRecord } from "../protocol/scene";
import { type Traversal, traversalOf } from "../protocol/traversal";
import { GAP } from "../watch/frame_buffer";
import { between, type Frame, place, usersBetween } from "../watch/interpolation";
import { lastBefore } from "./scrubber";

const NEAR = 8; // frames whose surfaces are kept in the cache
const NEXT = 0.15; // s; a recording has some 15 surfaces a second, a sign of life comes twice a second
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
  private readonly near: Map<Uint8Array | undefined, Made>; // by the frame's bytes, least recently used first
  private readonly records: (readonly UserRecord[] | undefined)[] = [];
  private readonly positions: Float32Array;
  private drawn = "";
  private readonly traversal: () => Traversal;

  /** @param before Player of another part of the same session, whose surfaces are taken over. */
  constructor(readonly recording: Recording, before?: Player) {
    const { mesh } = recording;
    this.positions = before?.positions ?? Float32Array.from(mesh.vertices);
    this.near = before?.near ?? new Map<Uint8Array | undefined, Made>();
    let found: Traversal | null = null;
    this.traversal = before?.traversal ?? ((): Traversal => (found ??= traversalOf(mesh.vertices.length / 3, mesh.faces)));
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
    const bytes = this.recording.frames[i];
    const kept = this.near.get(bytes);
    this.near.delete(bytes);
    const made = kept?.complete === true ? kept : this.make(i);
    this.near.set(bytes, made);
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
    const scene = this.decoded(bytes, this.times[i] ?? 0);
    const { t_server, users, room } = scene;
    if (scene.surface !== null) {
      const { scale, units } = scene.surface;
      return { t_server, users, room, displacement: Float32Array.from(units, (u) => scale * u), complete: true };
    }
    const made = surface?.(users) ?? null;
    if (made !== null) return { t_server, users, room, displacement: made, complete: true };
    const between = surface === null && !hasSurface(bytes) ? this.between(i, t_server) : null;
    if (between !== null) return { t_server, users, room, displacement: between, complete: true };
    // The former surface: a sign of life means that nothing moved, and an old surface is better than a flat one.
    const before = this.before(i);
    const displacement = before?.displacement ?? new Float32Array(mesh.vertices.length);
    return { t_server, users, room, displacement, complete: surface === null };
  }

  /** A scene; a damaged surface of a file is none. */
  private decoded(bytes: Uint8Array, t_server: number): Scene {
    try {
      return decodeScene(bytes, this.traversal);
    } catch (error) {
      if (!(error instanceof ProtocolError)) throw error;
      return { tick: 0, t_server, users: [], room: NOWHERE, surface: null };
    }
  }

  /** Displacement of a frame without a surface, straight between its neighbours with one, if these are near in time. */
  private between(i: number, t: number): Float32Array | null {
    const [k, j] = [this.withSurface(i, -1, t), this.withSurface(i, 1, t)];
    if (k < 0 || j < 0) return null;
    const [a, b] = [this.frame(k), this.frame(j)];
    const share = (t - a.t_server) / (b.t_server - a.t_server);
    return a.displacement.map((u, n) => u + share * ((b.displacement[n] ?? u) - u));
  }

  /** The nearest frame with a surface in one direction of time; -1 for none within `NEXT` seconds. */
  private withSurface(i: number, by: 1 | -1, t: number): number {
    for (let k = i + by; Math.abs((this.times[k] ?? Infinity) - t) <= NEXT; k += by) {
      if (hasSurface(this.recording.frames[k])) return k;
    }
    return -1;
  }

  /** The newest earlier frame that has a surface of its own or is in the cache. */
  private before(i: number): Made | undefined {
    for (let k = i - 1; k >= 0; k -= 1) {
      const kept = this.near.get(this.recording.frames[k]);
      if (kept !== undefined) return kept;
      if (this.recording.surface === null && hasSurface(this.recording.frames[k])) return this.make(k);
    }
    return undefined;
  }
}

const NOWHERE = { lag: 0, coupling: 0, margin: 0 };
const NOTHING = new Float32Array();

/** Whether a frame brings the surface, by its flags (docs/protocol.md). */
export function hasSurface(frame: Uint8Array | undefined): boolean {
  return (frame?.[2] ?? 0) !== 0;
}
