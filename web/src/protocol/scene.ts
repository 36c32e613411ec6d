/**
 * Server to client, on a watch connection: who touches where, and the surface if the client asked for it.
 *
 * A scene is a state and not an event: the newest scene replaces every older one.
 */

import type { RoomLag } from "../model/body";
import type { GeometryName, LawName } from "../model/laws";
import { add, norm, type Vec3 } from "../model/vec";
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
  MAX_FORCE,
  MAX_LOOP_DELAY,
  MAX_POSITION,
  MAX_STIFFNESS,
  MAX_USER_CURVATURE,
  MAX_USERS,
  readSceneFields,
  readUserFields,
  SCENE_SIZE,
  USER_SIZE,
  type UserFields,
} from "./layout";
import { checkLedger, checkRoom, geometryOf, lawOf } from "./patch";
import { decodeSurface, type SceneSurface } from "./scene_surface";
import type { Traversal } from "./traversal";

const FRESH = 1;
const FRICTION = 2;

/** One user at one tick. */
export interface UserRecord extends Omit<UserFields, "shape" | "state" | "to_free"> {
  /** Contact point of the surface without this user's own force [m]. */
  readonly x_free: Vec3;
  readonly law: LawName;
  readonly geometry: GeometryName;
  readonly fresh: boolean;
  readonly friction: boolean;
}

export interface Scene {
  readonly tick: number;
  /** Time of the tick on the server's clock [s]. */
  readonly t_server: number;
  /** Users in the room, including users who have left and whose force still fades. */
  readonly users: readonly UserRecord[];
  /** Surface of the body; null in a frame of forces only. */
  readonly surface: SceneSurface | null;
  readonly room: RoomLag;
}

/**
 * Decode the scene in a frame; throws ProtocolError for any invalid bytes.
 *
 * @param traversal Returns the traversal of the rest mesh; called only for a frame with a surface.
 */
export function decodeScene(bytes: Uint8Array, traversal: () => Traversal): Scene {
  const { rest, ...scene } = readUsers(bytes);
  return { ...scene, surface: rest && decodeSurface(rest, traversal()) };
}

/** Decode only the users of a frame and not its surface; throws ProtocolError. */
export function decodeUsers(bytes: Uint8Array): readonly UserRecord[] {
  return readUsers(bytes).users;
}

function readUsers(bytes: Uint8Array): Omit<Scene, "surface"> & { readonly rest: Uint8Array | null } {
  const { flags, view } = openFrame(bytes, "scene", SCENE_SIZE);
  checkRange("flags of a scene", flags, 0, 1);
  const { tick, t_server, users: count, room } = readSceneFields(view);
  checkRange("tick of a scene", tick, 1, U32);
  checkFinite("time stamp", t_server);
  checkRange("users of a scene", count, 0, MAX_USERS);
  checkRoom(room);
  const end = SCENE_SIZE + count * USER_SIZE;
  if (bytes.length < end) throw new ProtocolError("scene length", bytes.length, `at least ${end} bytes`);
  const users = Array.from({ length: count }, (_, k) => readUser(view, SCENE_SIZE + k * USER_SIZE));
  if (flags === 0) checkSize("scene", bytes, end);
  return { tick, t_server, users, room, rest: flags === 0 ? null : bytes.subarray(end) };
}

function readUser(view: DataView, at: number): UserRecord {
  const { shape, state, to_free, ...fields } = readUserFields(view, at);
  checkRange("state of a user", state, 0, FRESH | FRICTION);
  const record = {
    ...fields,
    x_free: add(fields.probe, to_free),
    law: lawOf(shape >> 4),
    geometry: geometryOf(shape & 0x0f),
    fresh: (state & FRESH) !== 0,
    friction: (state & FRICTION) !== 0,
  };
  check(record);
  return record;
}

function check(record: UserRecord): void {
  checkRange("number of a user", record.user, 1, U32);
  checkVector("probe", record.probe, MAX_POSITION, "m");
  checkVector("foot", record.foot, MAX_POSITION, "m");
  checkVector("force", record.force, 3 * MAX_FORCE, "N");
  checkRange("c_ii", record.c_ii, 0, MAX_POSITION);
  checkRange("k_o_coupled", record.k_o_coupled, 0, MAX_STIFFNESS);
  checkRange("k_h", record.k_h, 0, MAX_STIFFNESS);
  checkRange("integral_gain", record.integral_gain, 0, 1e9);
  checkRange("loop_delay", record.loop_delay, 0, MAX_LOOP_DELAY);
  checkRange("length of normal", norm(record.normal), 0.999, 1.001);
  checkRange("curvature", record.curvature, -MAX_USER_CURVATURE, MAX_USER_CURVATURE);
  checkVector("x_free", record.x_free, MAX_POSITION, "m");
  checkLedger(record.ledger);
}
