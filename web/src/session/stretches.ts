/** The scenes of a recorded session round one time, in memory that does not grow: stretches of some seconds, fetched as they are needed. */

import { ProtocolError } from "../protocol/frame";
import { readSceneFields } from "../protocol/layout";
import { viewOf } from "../protocol/numbers";
import { decodeUsers } from "../protocol/scene";
import { hasSurface } from "../replay/player";

/** Length of a stretch [s]; a plot shows 6 s. */
export const LENGTH = 4;
/** Most bytes that are kept, beyond what is needed now. */
export const MOST_BYTES = 32 << 20;
const MOST_STRETCHES = 12;
const AT_ONCE = 2; // requests at a time; the server reads the file for one after another
const SETTLES = 0.3; // s after a jump in which the surface of the moment comes first
const REST = 1; // s before a stretch that did not come is requested again
const AHEAD = 1; // s of real time for which scenes are fetched before they are shown

/** Scenes in the order of their times. */
export interface Scenes {
  /** Times on the server's clock [s], rising. */
  readonly times: Float64Array;
  readonly frames: readonly Uint8Array[];
  /** Whether a scene brings its surface. */
  readonly surfaces: boolean;
}

/** Fetches the scenes from a time on until before another: the body of a response, or a rejection. */
export type FetchScenes = (from: number, to: number) => Promise<ArrayBuffer>;

interface Stretch extends Scenes {
  readonly bytes: number;
}

/**
 * Decode the server's response for a stretch; throws ProtocolError where it is cut. A damaged scene is left out, and one whose
 * time is not after the one before.
 *
 * @returns The scenes, and the time up to which they are complete [s].
 */
export function decodeStretch(body: ArrayBuffer): readonly [Scenes, number] {
  const bytes = new Uint8Array(body);
  const view = viewOf(bytes);
  if (bytes.length < 8) throw new ProtocolError("length of a stretch", bytes.length, "at least 8 bytes");
  const until = view.getFloat64(0, true);
  const [times, frames]: [number[], Uint8Array[]] = [[], []];
  for (let at = 8; at < bytes.length;) {
    const length = at + 4 <= bytes.length ? view.getUint32(at, true) : Infinity;
    const frame = bytes.slice(at + 4, at + 4 + length);
    if (frame.length !== length) throw new ProtocolError("length of a scene", length, "one within the stretch");
    at += 4 + length;
    const t = timeOf(frame);
    if (t !== null && t > (times.at(-1) ?? -Infinity)) {
      times.push(t);
      frames.push(frame);
    }
  }
  return [{ times: Float64Array.from(times), frames, surfaces: frames.some(hasSurface) }, until];
}

/** Time of a scene; null for a damaged one. */
function timeOf(frame: Uint8Array): number | null {
  try {
    decodeUsers(frame);
    return readSceneFields(viewOf(frame)).t_server;
  } catch (error) {
    if (error instanceof ProtocolError) return null;
    throw error;
  }
}

/** Scenes of several stretches that follow each other. */
export function joined(parts: readonly Scenes[]): Scenes {
  const times = new Float64Array(parts.reduce((sum, part) => sum + part.times.length, 0));
  let at = 0;
  for (const part of parts) {
    times.set(part.times, at);
    at += part.times.length;
  }
  return { times, frames: parts.flatMap(({ frames }) => frames), surfaces: parts.some(({ surfaces }) => surfaces) };
}

export class Stretches {
  /** Why the newest request failed, in words; empty since one has succeeded. */
  trouble = "";
  private readonly kept = new Map<number, Stretch>();
  private readonly pending = new Set<number>();
  private readonly failed = new Map<number, number>(); // time before which a stretch is not requested again
  private wanted: readonly number[] = [];
  private shown: { readonly key: string; readonly scenes: Scenes } = { key: "", scenes: joined([]) };
  private readonly most: number;
  private here = 0;
  private settled = 0; // time from which on more than the stretch of the moment is fetched, after a jump

  /**
   * @param first First and last time of the session on the server's clock [s].
   * @param now Time on the page's clock [s].
   */
  constructor(private readonly first: number, last: number, private readonly fetch: FetchScenes, private readonly now: () => number) {
    this.most = Math.max(0, Math.floor((last - first) / LENGTH));
  }

  get bytes(): number {
    return [...this.kept.values()].reduce((sum, { bytes }) => sum + bytes, 0);
  }

  get size(): number {
    return this.kept.size;
  }

  /** Whether the scenes at a time are there. */
  has(t: number): boolean {
    return this.kept.has(this.numberOf(t));
  }

  /** Fetch what is needed at a time, and next: the stretches on both sides, for plots, and more of them where time goes fast. */
  want(t: number, speed: number): void {
    const here = this.numberOf(t);
    if (Math.abs(here - this.here) > 1) this.settled = Infinity;
    this.here = here;
    if (this.settled === Infinity && this.kept.has(here)) this.settled = this.now() + SETTLES;
    if (this.now() < this.settled) {
      this.wanted = [here];
      this.fetchMore();
      return;
    }
    const ahead = Math.max(1, Math.ceil((AHEAD * speed) / LENGTH));
    this.wanted = [here, here + 1, here - 1, ...Array.from({ length: ahead - 1 }, (_, k) => here + 2 + k)].filter((n) => n >= 0 && n <= this.most);
    this.fetchMore();
  }

  /** The scenes round a time that are there without a gap; the same object until that changes. */
  round(t: number): Scenes {
    const here = this.numberOf(t);
    let [low, high] = [here, here];
    while (low > here - 2 && this.kept.has(low - 1)) low -= 1;
    while (high < here + 2 && this.kept.has(high + 1)) high += 1;
    const key = this.kept.has(here) ? `${low} ${high}` : "";
    if (key !== this.shown.key) {
      const parts = key === "" ? [] : Array.from({ length: high - low + 1 }, (_, k) => this.kept.get(low + k)).filter((part) => part !== undefined);
      this.shown = { key, scenes: joined(parts) };
    }
    return this.shown.scenes;
  }

  private numberOf(t: number): number {
    return Math.min(this.most, Math.max(0, Math.floor((t - this.first) / LENGTH)));
  }

  private fetchMore(): void {
    for (const n of this.wanted) {
      if (this.pending.size >= AT_ONCE) return;
      if (this.kept.has(n) || this.pending.has(n) || (this.failed.get(n) ?? -Infinity) > this.now()) continue;
      this.pending.add(n);
      void this.load(n)
        .then((stretch) => {
          this.trouble = "";
          this.failed.delete(n);
          this.keep(n, stretch);
        })
        .catch((error: unknown) => {
          this.trouble = `the scenes do not come: ${error instanceof Error ? error.message : String(error)}`;
          this.failed.set(n, this.now() + REST);
        })
        .finally(() => {
          this.pending.delete(n);
          this.fetchMore();
        });
    }
  }

  /** Fetch a stretch in as many parts as the server makes of it. */
  private async load(n: number): Promise<Stretch> {
    const end = this.first + LENGTH * (n + 1);
    const parts: Scenes[] = [];
    let [from, bytes] = [this.first + LENGTH * n, 0];
    while (from < end && bytes < MOST_BYTES) {
      const body = await this.fetch(from, end);
      const [scenes, until] = decodeStretch(body);
      parts.push(scenes);
      bytes += body.byteLength;
      if (!(until > from)) throw new ProtocolError("end of a stretch", until, `more than ${from}`);
      from = until;
    }
    return { ...joined(parts), bytes };
  }

  /** Keep a stretch, and drop those that are farthest from what is wanted. */
  private keep(n: number, stretch: Stretch): void {
    this.kept.set(n, stretch);
    const [here = n] = this.wanted;
    const far = [...this.kept.keys()].sort((a, b) => Math.abs(b - here) - Math.abs(a - here));
    for (const farthest of far) {
      if (farthest === here || (this.kept.size <= MOST_STRETCHES && this.bytes <= MOST_BYTES)) break;
      this.kept.delete(farthest);
    }
  }
}
