/** Message of a watching client to the server: scenes up to this tick have come and are drawn. */

import { checkInteger, newFrame, U32 } from "./frame";
import { ACK_SIZE, writeAckFields } from "./layout";

/** Encode an ack; `wants` is 1 to get surfaces until the next ack, as Green's functions are missing, 0 to follow the encoding. */
export function encodeAck(tick: number, wants: 0 | 1): Uint8Array<ArrayBuffer> {
  checkInteger("tick of an ack", tick, 1, U32);
  const view = newFrame("ack", ACK_SIZE);
  writeAckFields(view, { tick, wants });
  return new Uint8Array(view.buffer);
}
