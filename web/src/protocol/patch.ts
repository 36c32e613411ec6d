/**
 * Server to client, once per simulation tick: the surface in front of one user, and its gains.
 *
 * The patch is the surface *free of this client's own force* (science 3.3); the present surface follows from it with
 * `c_ii` and `own_force`, x_o = x_free - c_ii own_force. Each number has bounds, so that no received number can make a
 * client's loop dangerous.
 */

import { isDefinite } from "../control/friction";
import type { Compliance3, RoomLag } from "../model/body";
import { type GeometryName, type LawName, LAWS } from "../model/laws";
import { norm } from "../model/vec";
import {
  checkFinite,
  checkRange,
  checkSize,
  checkVector,
  openFrame,
  ProtocolError,
  U32,
} from "./frame";
import {
  COMPLIANCE_SIZE,
  MAX_COUPLING,
  MAX_CURVATURE,
  MAX_FORCE,
  MAX_GAIN_CUT,
  MAX_LAG,
  MAX_POSITION,
  MAX_STIFFNESS,
  MIN_COMPLIANCE,
  PATCH_SIZE,
  type PatchFields,
  readCompliance,
  readPatchFields,
} from "./layout";
import { decodeNeighbourhood, type Neighbourhood } from "./neighbourhood";

const COMPLIANCE_FLAG = 0x0100;
const KNOWN_FLAGS = 2 * COMPLIANCE_FLAG - 1;
const ROUNDING = 1e-6; // share of c_ii, for its rounding to 32 bits
const GEOMETRIES: readonly (GeometryName | undefined)[] = [undefined, "plane", "sphere", "mesh"];

/** One user's local surface and the gains with which the local model presses on it. */
export interface Patch extends PatchFields {
  readonly geometry: GeometryName;
  readonly law: LawName;
  readonly neighbourhood: Neighbourhood | null;
  readonly compliance: Compliance3 | null;
}

/** Law for its number in the protocol; throws ProtocolError. */
export function lawOf(number: number): LawName {
  const law = LAWS[number - 1];
  if (law === undefined) throw new ProtocolError("law of a frame", number, `1 to ${LAWS.length}`);
  return law;
}

/** Geometry for its number in the protocol; throws ProtocolError. */
export function geometryOf(number: number): GeometryName {
  const geometry = GEOMETRIES[number];
  if (geometry === undefined) throw new ProtocolError("geometry of a frame", number, "1, 2 or 3");
  return geometry;
}

/** Decode the patch in a frame; throws ProtocolError for any invalid bytes. */
export function decodePatch(bytes: Uint8Array): Patch {
  const { flags, view } = openFrame(bytes, "patch", PATCH_SIZE);
  const geometry = geometryOf(flags & 0x000f);
  const law = lawOf((flags >> 4) & 0x000f);
  checkRange("flags of a patch", flags, 0, KNOWN_FLAGS);
  const size = PATCH_SIZE + (flags & COMPLIANCE_FLAG ? COMPLIANCE_SIZE : 0);
  if (bytes.length < size) throw new ProtocolError("patch length", bytes.length, `at least ${size} bytes`);
  if (geometry !== "mesh") checkSize("patch", bytes, size);
  const patch = {
    ...readPatchFields(view),
    geometry,
    law,
    neighbourhood: geometry === "mesh" ? decodeNeighbourhood(bytes.subarray(size)) : null,
    compliance: flags & COMPLIANCE_FLAG ? readCompliance(view, PATCH_SIZE) : null,
  };
  check(patch);
  return patch;
}

function check(patch: Patch): void {
  checkRange("tick of a patch", patch.tick, 1, U32);
  checkFinite("time stamp", patch.t_server, patch.t_client);
  checkRange("sample_wait", patch.sample_wait, 0, 1e6);
  checkVector("x_free", patch.x_free, MAX_POSITION, "m");
  checkFinite("normal", ...patch.normal);
  checkRange("length of normal", norm(patch.normal), 0.999, 1.001);
  checkRange("curvature", patch.curvature, -MAX_CURVATURE, MAX_CURVATURE);
  checkRange("c_ii", patch.c_ii, MIN_COMPLIANCE * (1 - ROUNDING), MAX_POSITION);
  checkRange("k_h", patch.k_h, 0, MAX_STIFFNESS);
  checkRange("integral_gain", patch.integral_gain, 0, 1e9);
  checkVector("own_force", patch.own_force, MAX_FORCE, "N");
  checkVector("u_others", patch.u_others, MAX_POSITION, "m");
  checkRoom(patch.room);
  checkLedger(patch.ledger);
  for (const c of patch.compliance ?? []) checkRange("compliance", c, -MAX_POSITION, MAX_POSITION);
  if (patch.compliance !== null && !isDefinite(patch.compliance)) {
    throw new ProtocolError("compliance", `(${patch.compliance.join(", ")})`, "positive definite");
  }
}

/** Check the lag of the room in a patch or scene; throws ProtocolError for impossible values. */
export function checkRoom(room: RoomLag): void {
  checkRange("lag of the room", room.lag, 0, MAX_LAG);
  checkRange("coupling of the room", room.coupling, 0, MAX_COUPLING);
  checkRange("margin of the room", room.margin, 0, Infinity);
}

/** Check what a tick made of a user's force, in a patch or scene; throws ProtocolError for impossible values. */
export function checkLedger(ledger: PatchFields["ledger"]): void {
  const { gain_cut, ...entries } = ledger;
  for (const newtons of Object.values(entries)) checkRange("entry of a tick's ledger", newtons, -3 * MAX_FORCE, 3 * MAX_FORCE);
  checkRange("gain_cut", gain_cut, 0, MAX_GAIN_CUT);
}
