import { describe, expect, test } from "vitest";
import type { RestMesh } from "../../src/model/body";
import type { Vec3 } from "../../src/model/vec";
import { Blocks, MOST_BLOCKS } from "../../src/watch/green_blocks";
import { type Block, decodeBlock, displacementOf, needed, pressesOf } from "../../src/watch/green_surface";
import { pressure } from "../../src/watch/pressure";
import { quadratureOf } from "../../src/watch/quadrature";
import { expectClose } from "../close";
import { fromHex, vectors } from "../vectors";

interface Under {
  radius: number;
  foot: Vec3;
  vertices: number[];
  weights: number[];
}

interface Ring {
  along: number;
  round: number;
  radius: number;
  tube: number;
}

interface Forces {
  vertices: number[][];
  faces: number[][];
  contacts: (Under & { force: Vec3 })[];
  blocks: Record<string, string>;
  displacement: number[][];
  ring: Ring & { contacts: Under[] };
}

const example = vectors("forces") as Forces;
const mesh = {
  vertices: Float32Array.from(example.vertices.flat()),
  faces: Uint32Array.from(example.faces.flat()),
};
const n = example.vertices.length;
const q = quadratureOf(mesh);
const blocks = new Map(
  Object.entries(example.blocks).map(([vertex, hex]): [number, Block] => [
    Number(vertex),
    decodeBlock(fromHex(hex).buffer as ArrayBuffer, n),
  ]),
);

describe("as the server", () => {
  // The wire's vertices have 32 bits: a micrometre in ten metres, a tenth of a millionth of a weight's radius.
  test.each(example.contacts)("weights of a pressure of radius $radius at $foot", ({ foot, radius, vertices, weights }) => {
    const found = pressure(q, foot, radius);
    expect(found.vertices).toEqual(vertices);
    expectClose(found.weights, weights, "weights", 1e-5, 1e-6);
  });

  test("forces make the surface, to a thousandth of the largest displacement", () => {
    const presses = example.contacts.flatMap(({ foot, force, radius }) => pressesOf([{ foot, force }], q, radius));
    const found = displacementOf(presses, (vertex) => blocks.get(vertex) ?? null, n);
    const expected = example.displacement.flat();
    const largest = Math.max(...expected.map(Math.abs));
    expect(largest).toBeGreaterThan(1e-3);
    expectClose(Array.from(found ?? []), expected, "displacement", 0, 1e-3 * largest);
  });
});

/** A ring of squares cut in two, as `test_forces_vector.py` makes it. */
function ringOf({ along, round, radius, tube }: Ring): RestMesh {
  const vertices: number[] = [];
  const faces: number[] = [];
  for (let i = 0; i < along; i += 1) {
    for (let j = 0; j < round; j += 1) {
      const [u, v] = [(2 * Math.PI * i) / along, (2 * Math.PI * j) / round];
      const out = radius + tube * Math.cos(v);
      vertices.push(out * Math.cos(u), out * Math.sin(u), tube * Math.sin(v));
      const [next, beside] = [((i + 1) % along) * round, (j + 1) % round];
      const [a, b, c, d] = [i * round + j, next + j, next + beside, i * round + beside];
      faces.push(a, b, c, a, c, d);
    }
  }
  return { vertices: Float32Array.from(vertices), faces: Uint32Array.from(faces) };
}

describe("on a fine mesh, as the server", () => {
  const fine = quadratureOf(ringOf(example.ring));

  test("a face carries one point; on one of 10,000 faces it still carries nine", () => {
    expect(fine.split).toBe(1);
    expect(quadratureOf(ringOf({ ...example.ring, along: 100, round: 50 })).split).toBe(9);
  });

  test.each(example.ring.contacts)("weights of a pressure of radius $radius", ({ foot, radius, vertices, weights }) => {
    const found = pressure(fine, foot, radius);
    expect(found.vertices).toEqual(vertices);
    expectClose(found.weights, weights, "weights", 1e-5, 1e-5);
  });
});

test("without a block there is no surface, and one who does not press needs none", () => {
  const press = pressesOf(example.contacts.slice(0, 1), q, 0.03);
  expect(displacementOf(press, () => null, n)).toBeNull();
  expect(needed(pressesOf([{ foot: [0, 0, 0.1], force: [0, 0, 0] }], q, 0.03))).toEqual([]);
  expect(displacementOf([], () => null, n)).toEqual(new Float32Array(3 * n));
});

test("a block of another mesh is refused", () => {
  expect(() => decodeBlock(new ArrayBuffer(4 + 18 * (n - 1)), n)).toThrow(`expected ${4 + 18 * n} bytes`);
});

describe("blocks", () => {
  const one = new ArrayBuffer(4 + 18 * 3);

  /** Fetches wait until they are answered. */
  class Server {
    readonly asked: number[] = [];
    private readonly answers: (() => void)[] = [];
    arrivals = 0;
    now = 0;
    fails = new Set<number>();
    readonly blocks = new Blocks(
      3,
      (vertex) => {
        this.asked.push(vertex);
        return new Promise((resolve, reject) => {
          this.answers.push(() => {
            if (this.fails.has(vertex)) reject(new Error("503"));
            else resolve(one);
          });
        });
      },
      () => this.now,
      () => {
        this.arrivals += 1;
      },
    );

    /** Answer until nothing more is asked. */
    async answer(): Promise<void> {
      while (this.answers.length > 0) {
        for (const answer of this.answers.splice(0)) answer();
        await new Promise((resolve) => setImmediate(resolve));
      }
    }
  }

  test("are fetched six at once, and each once", async () => {
    const server = new Server();
    const all = Array.from({ length: 10 }, (_, i) => i);
    expect(server.blocks.ask(all)).toBe(false);
    expect(server.blocks.ask(all)).toBe(false);
    expect(server.asked).toEqual([0, 1, 2, 3, 4, 5]);
    expect(server.blocks.missing).toBe(10);
    await server.answer();
    expect(server.asked).toEqual(all);
    expect(server.arrivals).toBe(10);
    expect(server.blocks.ask(all)).toBe(true);
    expect(server.blocks.missing).toBe(0);
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
