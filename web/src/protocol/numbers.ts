/** What a DataView has no function for, in the little-endian order of all frames. */

import type { Vec3 } from "../model/vec";

export function viewOf(bytes: Uint8Array): DataView {
  return new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
}

/** The half float at an offset; today's browsers cannot read one. */
export function getFloat16(view: DataView, at: number): number {
  const bits = view.getUint16(at, true);
  const sign = bits & 0x8000 ? -1 : 1;
  const exponent = (bits >> 10) & 0x1f;
  const fraction = bits & 0x3ff;
  if (exponent === 0x1f) return fraction > 0 ? NaN : sign * Infinity;
  if (exponent === 0) return sign * fraction * 2 ** -24;
  return sign * (1 + fraction / 1024) * 2 ** (exponent - 15);
}

/** Three 32-bit floats behind each other. */
export function getVec(view: DataView, at: number): Vec3 {
  return [view.getFloat32(at, true), view.getFloat32(at + 4, true), view.getFloat32(at + 8, true)];
}

export function setVec(view: DataView, at: number, value: Vec3): void {
  value.forEach((x, i) => {
    view.setFloat32(at + 4 * i, x, true);
  });
}
