/** The lag of the room in a patch or scene, 8 bytes; `RoomLag` in `shared/cohaptic/control/room_lag.py`. */

import type { RoomLag } from "../model/body";
import { checkRange, type Reader } from "./frame";

const MAX_LAG = 60; // s
const MAX_COUPLING = 1e3;

/** Read the lag of the room; throws ProtocolError for impossible values. */
export function readRoom(reader: Reader): RoomLag {
  const room = { lag: reader.f32(), coupling: reader.f16(), margin: reader.f16() };
  checkRange("lag of the room", room.lag, 0, MAX_LAG);
  checkRange("coupling of the room", room.coupling, 0, MAX_COUPLING);
  checkRange("margin of the room", room.margin, 0, Infinity);
  return room;
}
