import { deflateSync } from "node:zlib";
import { expect, test } from "vitest";
import { inflate } from "../../src/protocol/inflate";

/** Bytes that hardly anything can shorten. */
const RAW = Uint8Array.from({ length: 300_000 }, (_, i) => (i * i * 2654435761) >>> 24);

test("the output of another library is inflated, at every level", () => {
  for (const level of [0, 1, 9]) {
    const raw = inflate("x", deflateSync(RAW, { level }), RAW.length);
    expect(Buffer.compare(raw, RAW)).toBe(0);
  }
});

test("whatever is behind a stream, or missing from it, is noticed", () => {
  const stream = deflateSync(RAW, { level: 1 });
  expect(() => inflate("x", Uint8Array.from([...stream, 0]), RAW.length)).toThrow(/checksum of x|inflated size of x/);
  expect(() => inflate("x", stream.subarray(0, 1000), RAW.length)).toThrow(/of x is/);
  expect(() => inflate("x", stream, RAW.length - 1)).toThrow('inflated size of x is "more"');
  expect(() => inflate("x", stream, RAW.length + 1)).toThrow(`inflated size of x is ${RAW.length}`);
  expect(() => inflate("x", Uint8Array.of(1, 2, 3), 3)).toThrow("content of x");
});
