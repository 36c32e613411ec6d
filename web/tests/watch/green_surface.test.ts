import { describe, expect, test } from "vitest";
import { type Block, decodeBlocks, displacementOf, needed, pressesOf } from "../../src/watch/green_surface";
import { pressure } from "../../src/watch/pressure";
import { quadratureOf } from "../../src/model/quadrature";
import { expectClose } from "../close";
import { fromHex } from "../vectors";
import { example } from "./forces";

const mesh = {
  vertices: Float32Array.from(example.vertices.flat()),
  faces: Uint32Array.from(example.faces.flat()),
};

const n = example.vertices.length;
const q = quadratureOf(mesh);

const blocks = new Map(
  Object.entries(example.blocks).flatMap(([vertex, hex]): [number, Block][] =>
    decodeBlocks(fromHex(hex).buffer as ArrayBuffer, n, 1).map((block) => [Number(vertex), block])),
);

describe("as the server", () => {
  // The wire's vertices have 32 bits: a micrometre in ten metres, a tenth of a millionth of a weight's radius.
  test.each(example.contacts)("weights of a pressure of radius $radius at $foot", ({ foot, normal, radius, vertices, weights }) => {
    const found = pressure(q, foot, normal, radius);
    expect(found.vertices).toEqual(vertices);
    expectClose(found.weights, weights, "weights", 1e-5, 1e-6);
  });

  test("forces make the surface, to a thousandth of the largest displacement", () => {
    const presses = example.contacts.flatMap(({ foot, normal, force, radius }) => pressesOf([{ foot, normal, force }], () => q, radius));
    const found = displacementOf(presses, (vertex) => blocks.get(vertex) ?? null, n);
    const expected = example.displacement.flat();
    const largest = Math.max(...expected.map(Math.abs));
    expect(largest).toBeGreaterThan(1e-3);
    expectClose(Array.from(found ?? []), expected, "displacement", 0, 1e-3 * largest);
  });
});

test("without a block there is no surface, and one who does not press needs none", () => {
  const press = pressesOf(example.contacts.slice(0, 1), () => q, 0.03);
  expect(displacementOf(press, () => null, n)).toBeNull();
  expect(needed(pressesOf([{ foot: [0, 0, 0.1], normal: [0, 0, 1], force: [0, 0, 0] }], () => q, 0.03))).toEqual([]);
  expect(displacementOf([], () => null, n)).toEqual(new Float32Array(3 * n));
});

test("a block of another mesh is refused", () => {
  expect(() => decodeBlocks(new ArrayBuffer(4 + 18 * (n - 1)), n, 1)).toThrow(`expected ${4 + 18 * n} bytes`);
});

test("blocks of one response are those of one each", () => {
  const all = Object.values(example.blocks).map(fromHex);
  const together = new Uint8Array(all.reduce((sum, { length }) => sum + length, 0));
  all.reduce((at, bytes) => (together.set(bytes, at), at + bytes.length), 0);
  expect(decodeBlocks(together.buffer, n, all.length)).toEqual([...blocks.values()]);
  expect(() => decodeBlocks(together.buffer, n, all.length + 1)).toThrow("length of Green's functions");
});
