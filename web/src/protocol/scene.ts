/**
 * Server to client, on a watch connection: who touches where, and the surface if the client asked for it.
 *
 * A scene is a state and not an event: the newest scene replaces every older one.
 */

import type { RoomLag } from "../model/body";
import type { GeometryName, LawName } from "../model/laws";
import { norm, type Vec3 } from "../model/vec";
import {
  checkFinite,
  checkRange,
  checkSize,
  checkVector,
  MAX_FORCE,
  MAX_POSITION,
  openFrame,
  ProtocolError,
  type Reader,
  U32,
} from "./frame";
import { geometryOf, lawOf } from "./patch";
import { readRoom } from "./room_lag";
import { readSurface, type SceneSurface } from "./scene_surface";
import type { Traversal } from "./traversal";

const HEAD = 28;
const USER = 84;
const MAX_USERS = 256;
const MAX_STIFFNESS = 1e6; // N/m
const UNIT = 32767;
const FRESH = 1;
const FRICTION = 2;

/** One user at one tick; fields as in `docs/protocol.md`. */
export interface UserRecord {
  readonly user: number;
  readonly probe: Vec3;
  readonly foot: Vec3;
  readonly force: Vec3;
  readonly c_ii: number;
  readonly k_o_coupled: number;
  readonly k_h: number;
  readonly integral_gain: number;
  readonly loop_delay: number;
  readonly normal: Vec3;
  readonly law: LawName;
  readonly geometry: GeometryName;
  readonly presence: number;
  readonly curvature: number;
  readonly fresh: boolean;
  readonly friction: boolean;
  readonly x_free: Vec3;
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
  const { reader, whole, ...scene } = readUsers(bytes);
  return { ...scene, surface: whole ? readSurface(reader, traversal()) : null };
}

/** Decode only the users of a frame and not its surface; throws ProtocolError. */
export function decodeUsers(bytes: Uint8Array): readonly UserRecord[] {
  return readUsers(bytes).users;
}

function readUsers(bytes: Uint8Array): Omit<Scene, "surface"> & { readonly reader: Reader; readonly whole: boolean } {
  const { flags, reader } = openFrame(bytes, "scene", HEAD);
  checkRange("flags of a scene", flags, 0, 1);
  const tick = reader.u32();
  const t_server = reader.f64();
  const count = reader.u16();
  reader.skip(2);
  const room = readRoom(reader);
  checkRange("tick of a scene", tick, 1, U32);
  checkFinite("time stamp", t_server);
  checkRange("users of a scene", count, 0, MAX_USERS);
  const end = HEAD + count * USER;
  if (bytes.length < end) throw new ProtocolError("scene length", bytes.length, `at least ${end} bytes`);
  const users = Array.from({ length: count }, () => readUser(reader));
  if (flags === 0) checkSize("scene", bytes, end);
  return { tick, t_server, users, room, reader, whole: flags !== 0 };
}

function readUser(reader: Reader): UserRecord {
  const head = {
    user: reader.u32(),
    probe: reader.vec(),
    foot: reader.vec(),
    force: reader.vec(),
    c_ii: reader.f32(),
    k_o_coupled: reader.f32(),
    k_h: reader.f32(),
    integral_gain: reader.f32(),
    loop_delay: reader.f32(),
  };
  const normal: Vec3 = [reader.i16() / UNIT, reader.i16() / UNIT, reader.i16() / UNIT];
  const shape = reader.u8();
  const presence = reader.u8() / 255;
  const curvature = reader.f16();
  const state = reader.u8();
  reader.skip(1);
  checkRange("state of a user", state, 0, FRESH | FRICTION);
  const record = {
    ...head,
    normal,
    law: lawOf(shape >> 4),
    geometry: geometryOf(shape & 0x0f),
    presence,
    curvature,
    fresh: (state & FRESH) !== 0,
    friction: (state & FRICTION) !== 0,
    x_free: reader.vec(),
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
  checkRange("loop_delay", record.loop_delay, 0, 1e3);
  checkRange("length of normal", norm(record.normal), 0.999, 1.001);
  checkRange("curvature", record.curvature, -6e4, 6e4);
  checkVector("x_free", record.x_free, MAX_POSITION, "m");
}
