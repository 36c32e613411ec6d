/** Inflates a zlib stream of a known size, without ever holding more than that in memory. */

import { unzlibSync } from "fflate";
import { ProtocolError } from "./frame";
import { viewOf } from "./numbers";

/** Inflate to exactly `size` bytes; throws ProtocolError for another size, a broken stream, or bytes after the stream. */
export function inflate(field: string, deflated: Uint8Array, size: number): Uint8Array {
  let raw: Uint8Array;
  try {
    // The buffer has one byte more, to detect a stream that is too long. Nothing is written beyond the buffer.
    raw = unzlibSync(deflated, { out: new Uint8Array(size + 1) });
  } catch (error) {
    throw new ProtocolError(`content of ${field}`, String(error), "a zlib stream");
  }
  if (raw.length !== size) {
    const came = raw.length > size ? "more" : raw.length;
    throw new ProtocolError(`inflated size of ${field}`, came, `${size} bytes`);
  }
  const sum = viewOf(deflated).getUint32(deflated.length - 4);
  if (adler32(raw) !== sum) {
    throw new ProtocolError(`checksum of ${field}`, adler32(raw), `${sum}, with nothing behind it`);
  }
  return raw;
}

/** Checksum of RFC 1950, which fflate does not check. */
function adler32(bytes: Uint8Array): number {
  let a = 1;
  let b = 0;
  for (let i = 0; i < bytes.length; ) {
    // The sums over so many bytes stay below 2^53 without a division.
    const stop = Math.min(bytes.length, i + 65536);
    for (; i < stop; i += 1) {
      a += bytes[i] ?? 0;
      b += a;
    }
    a %= 65521;
    b %= 65521;
  }
  return b * 65536 + a;
}
