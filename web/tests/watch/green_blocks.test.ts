import { describe, expect, test } from "vitest";
import { GreenBlocks, MOST_BLOCKS } from "../../src/watch/green_blocks";

describe("blocks", () => {
  /** Fetches wait until they are answered. */
  class Server {
    readonly asked: number[] = [];
    /** Number of vertices of each request. */
    readonly groups: number[] = [];
    private readonly answers: (() => void)[] = [];
    arrivals = 0;
    now = 0;
    fails = new Set<number>();
    readonly blocks: GreenBlocks;

    constructor(vertices = 3) {
      const fetch = (group: readonly number[]): Promise<ArrayBuffer> => {
        this.asked.push(...group);
        this.groups.push(group.length);
        return new Promise((resolve, reject) => {
          this.answers.push(() => {
            if (group.some((vertex) => this.fails.has(vertex))) reject(new Error("503"));
            else resolve(new ArrayBuffer(group.length * (4 + 18 * vertices)));
          });
        });
      };
      this.blocks = new GreenBlocks(vertices, fetch, () => this.now, () => {
        this.arrivals += 1;
      });
    }

    /** Answer until nothing more is asked. */
    async answer(): Promise<void> {
      while (this.answers.length > 0) {
        for (const answer of this.answers.splice(0)) answer();
        await new Promise((resolve) => setImmediate(resolve));
      }
    }
  }

  test("are fetched in two requests at a time, and each once", async () => {
    const server = new Server();
    const all = Array.from({ length: 70 }, (_, i) => i);
    expect(server.blocks.ask(all)).toBe(false);
    expect(server.blocks.ask(all)).toBe(false);
    expect(server.asked).toEqual(all.slice(0, 64));
    expect(server.blocks.missing).toBe(70);
    await server.answer();
    expect(server.asked).toEqual(all);
    expect(server.groups).toEqual([32, 32, 6]);
    expect(server.arrivals).toBe(3);
    expect(server.blocks.ask(all)).toBe(true);
    expect(server.blocks.missing).toBe(0);
  });

  test("of a large body come in responses that a slow link can take", () => {
    const server = new Server(2562);
    server.blocks.ask(Array.from({ length: 40 }, (_, i) => i));
    expect(server.groups).toEqual([8, 8]);
    const larger = new Server(50_000);
    larger.blocks.ask([1, 2, 3]);
    expect(larger.groups).toEqual([1, 1]);
  });

  test("give up the least recently used", async () => {
    const server = new Server();
    for (let i = 0; i < MOST_BLOCKS; i += 1) server.blocks.ask([i]);
    server.blocks.ask(Array.from({ length: MOST_BLOCKS }, (_, i) => i));
    await server.answer();
    server.blocks.get(0);
    server.blocks.ask([1000]);
    await server.answer();
    expect(server.blocks.size).toBe(MOST_BLOCKS);
    expect(server.blocks.get(0)).not.toBeNull();
    expect(server.blocks.get(1)).toBeNull();
  });

  test("that could never be here together are not fetched at all", () => {
    const server = new Server();
    expect(server.blocks.ask(Array.from({ length: MOST_BLOCKS + 1 }, (_, i) => i))).toBe(false);
    expect(server.asked).toEqual([]);
  });

  test("that could not be had are asked for again after a second", async () => {
    const server = new Server();
    server.fails.add(7);
    server.blocks.ask([7]);
    await server.answer();
    server.blocks.ask([7]);
    expect(server.asked).toEqual([7]);
    server.now = 1.1;
    server.fails.clear();
    server.blocks.ask([7]);
    await server.answer();
    expect(server.asked).toEqual([7, 7]);
    expect(server.blocks.ask([7])).toBe(true);
  });
});
