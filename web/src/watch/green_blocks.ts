/** Fetches blocks of Green's functions and caches them; the least recently used are dropped first. */

import { type Block, blockSize, decodeBlocks } from "./green_surface";

export const MOST_BLOCKS = 256; // 12 MB for 2,562 vertices
// Requests at a time: the second is on its way while the first is answered.
const AT_ONCE = 2;
const MOST_OF_A_REQUEST = 32; // blocks, as the server allows
// Bytes of one response, some seconds of a slow link: of a large body a request has fewer blocks.
const RESPONSE = 400_000;
const REST = 1; // s before a block that could not be fetched is requested again

/** Fetches the blocks of some vertices, one after the other: the body of a response, or a rejection. */
export type Fetch = (vertices: readonly number[]) => Promise<ArrayBuffer>;

/** The blocks of one model. */
export class GreenBlocks {
  private readonly kept = new Map<number, Block>(); // in the order of their last use
  private readonly pending = new Set<number>();
  private requests = 0;
  private readonly failed = new Map<number, number>(); // time before which a vertex is not requested again
  private requested: readonly number[] = [];

  /**
   * @param vertices Number of vertices of the resting mesh.
   * @param arrived Called when more blocks have come.
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
    const most = Math.max(1, Math.min(MOST_OF_A_REQUEST, Math.floor(RESPONSE / blockSize(this.vertices))));
    while (this.requests < AT_ONCE) {
      const group = this.requested.filter((vertex) => this.isWanted(vertex)).slice(0, most);
      if (group.length === 0) return;
      this.requests += 1;
      for (const vertex of group) this.pending.add(vertex);
      void this.fetch(group)
        .then((bytes) => {
          this.keep(group, decodeBlocks(bytes, this.vertices, group.length));
        })
        .catch(() => {
          for (const vertex of group) this.failed.set(vertex, this.now() + REST);
        })
        .finally(() => {
          this.requests -= 1;
          for (const vertex of group) this.pending.delete(vertex);
          this.fetchMore();
        });
    }
  }

  private isWanted(vertex: number): boolean {
    const rests = (this.failed.get(vertex) ?? -Infinity) > this.now();
    return !this.kept.has(vertex) && !this.pending.has(vertex) && !rests;
  }

  private keep(vertices: readonly number[], blocks: readonly Block[]): void {
    for (const [k, vertex] of vertices.entries()) {
      const block = blocks[k];
      if (block === undefined) continue;
      this.failed.delete(vertex);
      this.kept.set(vertex, block);
    }
    for (const oldest of this.kept.keys()) {
      if (this.kept.size <= MOST_BLOCKS) break;
      this.kept.delete(oldest);
    }
    this.arrived();
  }
}
