/** Fetches blocks of Green's functions and caches them; the least recently used are dropped first. */

import { type Block, decodeBlock } from "./green_surface";

export const MOST_BLOCKS = 256; // 12 MB for 2,562 vertices
const AT_ONCE = 6; // requests at a time; a browser has no more connections to one server
const REST = 1; // s before a block that could not be fetched is requested again

/** Fetches one block: the body of a response, or a rejection. */
export type Fetch = (vertex: number) => Promise<ArrayBuffer>;

/** The blocks of one model. */
export class GreenBlocks {
  private readonly kept = new Map<number, Block>(); // in the order of their last use
  private readonly pending = new Set<number>();
  private readonly failed = new Map<number, number>(); // time before which a vertex is not requested again
  private requested: readonly number[] = [];

  /**
   * @param vertices Number of vertices of the resting mesh.
   * @param arrived Called when one more block has come.
   */
  constructor(
    private readonly vertices: number,
    private readonly fetch: Fetch,
    private readonly now: () => number,
    private readonly arrived: () => void,
  ) {}

  get size(): number {
    return this.kept.size;
  }

  /** Number of the blocks requested last that have not come. */
  get missing(): number {
    return this.requested.filter((vertex) => !this.kept.has(vertex)).length;
  }

  readonly get = (vertex: number): Block | null => {
    const block = this.kept.get(vertex);
    if (block === undefined) return null;
    this.kept.delete(vertex);
    this.kept.set(vertex, block);
    return block;
  };

  /** Whether the blocks of all these vertices are cached; missing ones are fetched, unless the cache is too small for all. */
  ask(vertices: readonly number[]): boolean {
    this.requested = vertices;
    const complete = vertices.every((vertex) => this.get(vertex) !== null);
    if (!complete && vertices.length <= MOST_BLOCKS) this.fetchMore();
    return complete;
  }

  private fetchMore(): void {
    const now = this.now();
    for (const vertex of this.requested) {
      if (this.pending.size >= AT_ONCE) return;
      const rests = (this.failed.get(vertex) ?? -Infinity) > now;
      if (this.kept.has(vertex) || this.pending.has(vertex) || rests) continue;
      this.pending.add(vertex);
      void this.fetch(vertex)
        .then((bytes) => {
          this.keep(vertex, decodeBlock(bytes, this.vertices));
        })
        .catch(() => {
          this.failed.set(vertex, this.now() + REST);
        })
        .finally(() => {
          this.pending.delete(vertex);
          this.fetchMore();
        });
    }
  }

  private keep(vertex: number, block: Block): void {
    this.failed.delete(vertex);
    this.kept.set(vertex, block);
    for (const oldest of this.kept.keys()) {
      if (this.kept.size <= MOST_BLOCKS) break;
      this.kept.delete(oldest);
    }
    this.arrived();
  }
}
