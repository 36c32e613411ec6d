/**
 * The common part of all binary frames: the header, and range checks of received values.
 *
 * A frame is little-endian and packed: `u8 version, u8 kind, u16 flags`, then the body of its kind.
 */

import { norm, type Vec3 } from "../model/vec";
import { PROTOCOL_VERSION } from "./version";

export const MAX_POSITION = 10; // m
export const MAX_FORCE = 100; // N
export const HEADER_SIZE = 4;
export const U32 = 2 ** 32 - 1;

/** Second byte of every binary frame. */
export const Kind = { contact_sample: 1, patch: 2, rest_mesh: 3, scene: 4, ack: 5 } as const;
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

/** Reads a frame from front to back. */
export class Reader {
  private readonly view: DataView;
  private at = 0;

  constructor(private readonly bytes: Uint8Array) {
    this.view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  }

  get left(): number {
    return this.bytes.byteLength - this.at;
  }

  /** Position of the next value; moves on by `size` bytes. */
  private pass(size: number): number {
    const at = this.at;
    this.at += size;
    return at;
  }

  u8(): number {
    return this.view.getUint8(this.pass(1));
  }
  u16(): number {
    return this.view.getUint16(this.pass(2), true);
  }
  i16(): number {
    return this.view.getInt16(this.pass(2), true);
  }
  u32(): number {
    return this.view.getUint32(this.pass(4), true);
  }
  f16(): number {
    return half(this.u16());
  }
  f32(): number {
    return this.view.getFloat32(this.pass(4), true);
  }
  f64(): number {
    return this.view.getFloat64(this.pass(8), true);
  }
  vec(): Vec3 {
    return [this.f32(), this.f32(), this.f32()];
  }
  skip(size: number): void {
    this.pass(size);
  }
  rest(): Uint8Array {
    return this.bytes.subarray(this.pass(this.left));
  }
}

/** Convert the bits of a half float, for which today's browsers have no function. */
function half(bits: number): number {
  const sign = bits & 0x8000 ? -1 : 1;
  const exponent = (bits >> 10) & 0x1f;
  const fraction = bits & 0x3ff;
  if (exponent === 0x1f) return fraction > 0 ? NaN : sign * Infinity;
  if (exponent === 0) return sign * fraction * 2 ** -24;
  return sign * (1 + fraction / 1024) * 2 ** (exponent - 15);
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

/** Check version, kind and least length of a frame; returns its flags, and a reader behind the header. */
export function openFrame(
  bytes: Uint8Array,
  kind: KindName,
  least: number,
): { flags: number; reader: Reader } {
  if (bytes.length < HEADER_SIZE) {
    throw new ProtocolError("frame length", bytes.length, `at least ${HEADER_SIZE} bytes`);
  }
  const reader = new Reader(bytes);
  const version = reader.u8();
  if (version !== PROTOCOL_VERSION) {
    throw new ProtocolError("frame's protocol version", version, String(PROTOCOL_VERSION));
  }
  const got = reader.u8();
  if (got !== Kind[kind]) throw new ProtocolError("frame kind", got, `${Kind[kind]} (${kind})`);
  if (bytes.length < least) {
    throw new ProtocolError(`${kind} length`, bytes.length, `at least ${least} bytes`);
  }
  return { flags: reader.u16(), reader };
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
