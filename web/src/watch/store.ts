/**
 * The page's copy of the scene without I/O: messages and time in, acks and snapshots out.
 *
 * The connection (`connection.ts`) is the shell round it.
 */

import { type RestMesh, sameMesh } from "../model/body";
import type { Recording } from "../model/recording";
import type { Encoding, RoomEvent, SceneSnapshot, UserHistory, WatchInfo } from "../model/scene";
import { encodeAck } from "../protocol/ack";
import { encodeControl } from "../protocol/messages";
import type { Scene } from "../protocol/scene";
import { FrameBuffer } from "./frame_buffer";
import { FrameRing } from "./frame_ring";
import { GreenBlocks, type Fetch } from "./green_blocks";
import { displacementOf, needed, type Press, pressesOf } from "./green_surface";
import { Histories } from "./history";
import { frameInterval } from "./playout_clock";
import { type Quadrature, quadratureOf } from "../model/quadrature";
import { Room } from "./room";
import type { WatchEvent } from "./session";

/** All data that belong to one body. */
interface Held {
  readonly mesh: RestMesh;
  readonly frames: FrameBuffer;
  readonly quadrature: () => Quadrature;
  readonly model: string | null;
  /** Blocks of Green's functions; null if the surface is not a sum of them. */
  readonly blocks: GreenBlocks | null;
}

/** The scene of one room, over all connections to it. */
export class Store {
  info: WatchInfo | null = null;
  readonly room = new Room();
  private readonly histories = new Histories();
  private readonly ring = new FrameRing();
  private held: Held | null = null;
  private newest: Scene | null = null;
  private lacking: readonly Press[] = []; // loads of the newest scene, whose surface still has to be computed

  /**
   * @param fetch Fetches Green's functions of a model.
   * @param arrived Called when blocks have come, so that the shown surface may be better.
   */
  constructor(
    public encoding: Encoding,
    public rate: number,
    private readonly fetch: (model: string) => Fetch,
    private readonly now: () => number,
    private readonly arrived: () => void,
  ) {}

  get mesh(): RestMesh | null {
    return this.held?.mesh ?? null;
  }

  get events(): readonly RoomEvent[] {
    return this.room.events;
  }

  get playoutDelay(): number {
    return this.held?.frames.playoutDelay ?? 0;
  }

  /** Blocks in the cache, and blocks that are missing. */
  get blocks(): { readonly cached: number; readonly missing: number } {
    const blocks = this.held?.blocks;
    return { cached: blocks?.size ?? 0, missing: this.inUse === "forces" ? 0 : (blocks?.missing ?? 0) };
  }

  /** Encoding in use: frames while blocks are being fetched, and for bodies without Green's functions. */
  get inUse(): Encoding {
    return this.encoding === "forces" && this.held?.blocks !== null && this.wants === 0 ? "forces" : "frames";
  }

  /** Take a message of the server. */
  take(event: WatchEvent, now: number): void {
    this.room.take(event, now);
    if (event.type === "watching") {
      this.info = event;
      this.newest = null;
      this.lacking = [];
    } else if (event.type === "rest_mesh") {
      this.hold(event.mesh);
    } else if (event.type === "scene") {
      this.show(event.scene, now);
    }
  }

  /** The scene at `now`. */
  at(now: number): SceneSnapshot | null {
    return this.held?.frames.at(now, this.room) ?? null;
  }

  history(user: number): UserHistory | null {
    return this.histories.get(user);
  }

  /** Remember a scene as it came. */
  keep(t_server: number, frame: Uint8Array): void {
    this.ring.push(t_server, frame);
  }

  /** The last minute of this object. */
  recorded(): Recording | null {
    const { held, info } = this;
    if (held === null || info === null || this.ring.length === 0) return null;
    return {
      mesh: held.mesh, info, ...this.ring.take(), names: this.room.everybody, interval: this.interval,
      surface: held.blocks === null || held.model === null ? null : this.surfaceMaker(held, held.blocks, held.model),
    };
  }

  /** Makes past surfaces from a second cache of blocks, so that live ones keep theirs. The browser caches what was fetched once. */
  private surfaceMaker(held: Held, live: GreenBlocks, model: string): NonNullable<Recording["surface"]> {
    const vertices = held.mesh.vertices.length / 3;
    const own = new GreenBlocks(vertices, this.fetch(model), this.now, () => undefined);
    const radius = this.info?.body.contact_radius ?? 0;
    const get: GreenBlocks["get"] = (vertex) => live.get(vertex) ?? own.get(vertex);
    return (loads) => {
      const presses = pressesOf(loads, held.quadrature, radius);
      const missing = needed(presses).filter((vertex) => get(vertex) === null);
      if (missing.length > 0) own.ask(missing);
      return displacementOf(presses, get, vertices);
    };
  }

  /** Message that requests another encoding and rate. */
  setView(encoding: Encoding, rate: number): string {
    this.encoding = encoding;
    this.rate = Math.min(60, Math.max(1, rate));
    if (this.held !== null) this.held.frames.interval = this.interval;
    return encodeControl({ type: "set_view", encoding, rate: this.rate });
  }

  /** The ack of the newest scene, to be sent once it is drawn; null before the first. */
  ack(): Uint8Array<ArrayBuffer> | null {
    return this.newest === null ? null : encodeAck(this.newest.tick, this.wants);
  }

  /** To be called when blocks came: completes the surface of the newest scene if it is possible now. */
  complete(): void {
    if (this.held === null || this.held.blocks === null || this.lacking.length === 0) return;
    if (!this.held.blocks.ask(needed(this.lacking))) return;
    const made = this.make(this.held, this.lacking);
    if (made === null) return;
    if (this.newest?.surface === null) this.held.frames.amend(made);
    this.lacking = [];
  }

  private get wants(): 0 | 1 {
    return this.lacking.length > 0 ? 1 : 0;
  }

  private get interval(): number {
    return frameInterval(this.rate, this.info?.simulation_period ?? 0);
  }

  private hold(mesh: RestMesh): void {
    const before = this.held;
    const same = before !== null && sameMesh(before.mesh, mesh);
    // An unchanged mesh stays the same object, so that the view keeps the geometry that it made from it.
    const kept = same ? before.mesh : mesh;
    if (!same) {
      this.histories.clear();
      this.ring.clear();
    }
    const model = this.info?.model ?? null;
    this.held = {
      mesh: kept,
      frames: new FrameBuffer(kept, this.interval),
      quadrature: same ? before.quadrature : once(() => quadratureOf(mesh)),
      model,
      blocks: same && before.model === model ? before.blocks : this.newBlocks(model, mesh),
    };
  }

  private newBlocks(model: string | null, mesh: RestMesh): GreenBlocks | null {
    if (model === null) return null;
    return new GreenBlocks(mesh.vertices.length / 3, this.fetch(model), this.now, () => {
      this.complete();
      this.arrived();
    });
  }

  private show(scene: Scene, now: number): void {
    if (this.held === null) return;
    this.newest = scene;
    this.histories.push(scene.t_server, scene.users);
    this.held.frames.take(scene, this.surfaceOf(this.held, scene), now);
  }

  /** Displacement that a scene contains, or that follows from its forces; null while blocks are missing. */
  private surfaceOf(held: Held, scene: Scene): Float32Array | null {
    this.lacking = [];
    if (this.encoding === "forces" && held.blocks !== null) {
      const radius = this.info?.body.contact_radius ?? 0;
      const presses = pressesOf(scene.users, held.quadrature, radius);
      // Blocks are requested even if a surface came, because the server sends one while they are missing.
      if (!held.blocks.ask(needed(presses))) this.lacking = presses;
      else if (scene.surface === null) return this.make(held, presses);
    }
    if (scene.surface === null) return null;
    const { scale, units } = scene.surface;
    return Float32Array.from(units, (u) => scale * u);
  }

  private make(held: Held, presses: readonly Press[]): Float32Array | null {
    return held.blocks === null ? null : displacementOf(presses, held.blocks.get, held.mesh.vertices.length / 3);
  }
}

/** A function that makes its value at the first call and returns the same value at each later call. */
function once<T>(make: () => T): () => T {
  let made: T | null = null;
  return () => (made ??= make());
}
