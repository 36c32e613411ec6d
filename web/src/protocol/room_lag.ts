/** What patch and scene say of the room's time, 8 bytes; `RoomLag` in `shared/cohaptic/control/room_lag.py`. */

import type { RoomLag } from "../types";
import { checkRange, type Reader } from "./frame";

const MAX_LAG = 60; // s
const MAX_COUPLING = 1e3;

/** Throws ProtocolError unless what is said can be true. */
export function readRoom(reader: Reader): RoomLag {
  const room = { lag: reader.f32(), coupling: reader.f16(), margin: reader.f16() };
  checkRange("lag of the room", room.lag, 0, MAX_LAG);
  checkRange("coupling of the room", room.coupling, 0, MAX_COUPLING);
  checkRange("margin of the room", room.margin, 0, Infinity);
  return room;
}
