/** The golden vectors of the repository, as the Python side wrote them. */

import { readFileSync } from "node:fs";

const FOLDER = new URL("../../tests/vectors/", import.meta.url);

/** The values in a file of vectors; the caller knows their type. */
export function vectors(name: string): unknown {
  return JSON.parse(readFileSync(new URL(`${name}.json`, FOLDER), "utf8"));
}

export interface BinaryVector<T> {
  readonly name: string;
  readonly hex: string;
  readonly fields: T;
}

export function fromHex(hex: string): Uint8Array {
  return Uint8Array.from(hex.match(/../g) ?? [], (pair) => parseInt(pair, 16));
}

export function toHex(bytes: Uint8Array): string {
  return Array.from(bytes, (b) => b.toString(16).padStart(2, "0")).join("");
}

/** Every shorter frame, and one that is longer. */
export function* wrongLengths(bytes: Uint8Array): Generator<Uint8Array> {
  for (let n = 0; n < bytes.length; n += 1) yield bytes.subarray(0, n);
  const longer = new Uint8Array(bytes.length + 1);
  longer.set(bytes);
  yield longer;
}

/** The frame with another byte, of each of its bytes. */
export function* oneByteWrong(bytes: Uint8Array): Generator<Uint8Array> {
  for (let i = 0; i < bytes.length; i += 1) {
    for (const flip of [0x01, 0x80, 0xff]) {
      const other = bytes.slice();
      other[i] = (other[i] ?? 0) ^ flip;
      yield other;
    }
  }
}

/** A decoder returns a message or throws this one type, whatever the bytes. */
export function outcome(decode: (bytes: Uint8Array) => unknown, bytes: Uint8Array): string {
  try {
    decode(bytes);
    return "decoded";
  } catch (error) {
    return error instanceof Error ? error.name : "thrown";
  }
}
