/**
 * The common part of all binary frames: the header, and range checks of received values.
 *
 * A frame is little-endian and packed: `u8 version, u8 kind, u16 flags`, then the body of its kind.
 */

import { norm, type Vec3 } from "../model/vec";
import { HEAD_SIZE, Kind, PROTOCOL_VERSION } from "./layout";
import { viewOf } from "./numbers";

export const U32 = 2 ** 32 - 1;

export type KindName = keyof typeof Kind;

/** A message broke the rules of `docs/protocol.md`. */
export class ProtocolError extends Error {
  override readonly name = "ProtocolError";

  /**
   * @param field The message or field at fault.
   * @param value The received value.
   * @param limit The valid values.
   */
  constructor(
    readonly field: string,
    readonly value: unknown,
    readonly limit: string,
  ) {
    super(`${field} is ${short(value)}; expected ${limit}`);
  }
}

/** Printable text of a received value, in one line. */
function short(value: unknown): string {
  const text = typeof value === "string" ? JSON.stringify(value) : String(value);
  const line = text.replace(/[\p{C}\p{Zl}\p{Zp}]/gu, "?");
  return line.length > 60 ? `${line.slice(0, 60)}...` : line;
}

/** A frame of `size` bytes with its header, and the view that its body is written through. */
export function newFrame(kind: KindName, size: number, flags = 0): DataView<ArrayBuffer> {
  const view = new DataView(new ArrayBuffer(size));
  view.setUint8(0, PROTOCOL_VERSION);
  view.setUint8(1, Kind[kind]);
  view.setUint16(2, flags, true);
  return view;
}

/** Kind of a frame; 0 if the frame is too short to have one. */
export function kindOf(bytes: Uint8Array): number {
  return bytes[1] ?? 0;
}

/** Check version, kind and least length of a frame; returns its flags, and the view that it is read through. */
export function openFrame(
  bytes: Uint8Array,
  kind: KindName,
  least: number,
): { flags: number; view: DataView } {
  if (bytes.length < HEAD_SIZE) {
    throw new ProtocolError("frame length", bytes.length, `at least ${HEAD_SIZE} bytes`);
  }
  const view = viewOf(bytes);
  const version = view.getUint8(0);
  if (version !== PROTOCOL_VERSION) {
    throw new ProtocolError("frame's protocol version", version, String(PROTOCOL_VERSION));
  }
  const got = view.getUint8(1);
  if (got !== Kind[kind]) throw new ProtocolError("frame kind", got, `${Kind[kind]} (${kind})`);
  if (bytes.length < least) {
    throw new ProtocolError(`${kind} length`, bytes.length, `at least ${least} bytes`);
  }
  return { flags: view.getUint16(2, true), view };
}

/** Check that the frame has exactly `size` bytes. */
export function checkSize(field: string, bytes: Uint8Array, size: number): void {
  if (bytes.length !== size) throw new ProtocolError(`${field} length`, bytes.length, `${size} bytes`);
}

export function checkFinite(field: string, ...values: readonly number[]): void {
  for (const value of values) {
    if (!Number.isFinite(value)) throw new ProtocolError(field, value, "a finite number");
  }
}

/** Check low <= value <= high; NaN is outside. */
export function checkRange(field: string, value: number, low: number, high: number): void {
  if (!(value >= low && value <= high)) {
    throw new ProtocolError(field, value, `from ${low} to ${high}`);
  }
}

export function checkInteger(field: string, value: number, low: number, high: number): void {
  checkRange(field, value, low, high);
  if (!Number.isInteger(value)) throw new ProtocolError(field, value, "a whole number");
}

/** Check that a vector is finite and no longer than `limit`. */
export function checkVector(field: string, value: Vec3, limit: number, unit: string): void {
  checkFinite(field, ...value);
  const length = norm(value);
  if (length > limit) {
    throw new ProtocolError(`length of ${field}`, `${length.toPrecision(4)} ${unit}`, `<= ${limit} ${unit}`);
  }
}
