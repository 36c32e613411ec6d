/** Client that watches to server: scenes up to this tick have come and are drawn. */

import { checkInteger, newFrame, U32 } from "./frame";

export const ACK_SIZE = 12;

/** `wants`: 1 for a surface until the next ack, since Green's functions are missing; 0 as the encoding says. */
export function encodeAck(tick: number, wants: 0 | 1): Uint8Array<ArrayBuffer> {
  checkInteger("tick of an ack", tick, 1, U32);
  const view = newFrame("ack", ACK_SIZE);
  view.setUint32(4, tick, true);
  view.setUint8(8, wants);
  return new Uint8Array(view.buffer);
}
