/**
 * Handshake and control: rare messages, as JSON text. Events: ordered, never dropped.
 *
 * client -> server    hello, come, set_name, set_law, bye; a watcher: watch, set_view, set_latency, moderate, present, follow, aim, point
 * server -> client    place, called, welcome, named, user_joined, user_left, restraints, recorded, error;
 *                     to a watcher: watching, latency, moderated, put_out, company, aimed, pointed, declined
 */

import type { BodyInfo } from "../model/body";
import type { Aim, Company, Presence } from "../model/company";
import type { GeometryName, LawName } from "../model/laws";
import type { Encoding, LoopRules } from "../model/scene";
import type { Order } from "../model/orders";
import type { Vec3 } from "../model/vec";
import { ProtocolError } from "./frame";
import { checkKeys, type Fields, flag, integer, isFields, list, number, object, parseFields, positive, text, vector } from "./json";
import { MAX_POSITION, PROTOCOL_VERSION } from "./layout";

export const MAX_TEXT = 4096; // characters of one control message
// The messages `watching` and `welcome` list the names of everybody in a full room.
const MAX_SERVER_TEXT = 65_536;
// Limits of a server's tick rate, 10 to 200 Hz; a loop that believed another rate would move to a new surface in no time,
// or for ever.
const MIN_PERIOD = 0.005; // s
const MAX_PERIOD = 0.1;
const MAX_BODY_NAME = 1024; // characters; a file's name, with room for its folders
const MAX_TURN = 3600; // s that a called client has to come

export interface FixedGains {
  readonly k_h: number;
  readonly integral_gain: number;
}

export type ClientControl =
  | {
      readonly type: "hello";
      readonly protocol: number;
      readonly name: string;
      readonly law: LawName;
      readonly max_stiffness: number;
      readonly max_force: number;
      readonly damping_budget: number;
      readonly geometry: GeometryName;
      readonly friction: boolean;
      readonly fixed_gains: FixedGains | null;
      /** 16 to 64 printable characters; not sent if there is none. */
      readonly key?: string;
      /** Token of an invitation or a session; not sent if there is none. */
      readonly token?: string;
      /** Whether the client waits for a seat if the room is full; not sent if not. */
      readonly wait?: true;
      /** Difference of the loop from the rules of this version; not sent if there is none. */
      readonly rules?: LoopRules;
    }
  | { readonly type: "come" }
  | { readonly type: "set_name"; readonly name: string }
  | { readonly type: "set_law"; readonly law: LawName; readonly fixed_gains: FixedGains | null }
  | { readonly type: "bye" }
  | {
      readonly type: "watch";
      readonly protocol: number;
      readonly encoding: Encoding;
      readonly rate: number;
      readonly mesh: "exact" | "quantised";
      readonly token?: string;
      /** Whether the client wants messages about the other people here; not sent if not. */
      readonly company?: true;
    }
  | ({ readonly type: "present" } & Presence)
  | { readonly type: "follow"; readonly user: number | null }
  | ({ readonly type: "aim" } & Aim)
  | { readonly type: "point"; readonly point: Vec3 }
  | { readonly type: "set_view"; readonly encoding: Encoding; readonly rate: number }
  | { readonly type: "set_latency"; readonly user: number; readonly delay?: number; readonly jitter?: number; readonly network: string }
  | { readonly type: "moderate"; readonly action: Order; readonly user: number | null; readonly name?: string };

type RoomUser = { readonly user: number; readonly name: string } & Ruled;

export interface Welcome {
  readonly type: "welcome";
  readonly protocol: number;
  readonly user: number;
  readonly name: string;
  readonly simulation_period: number;
  readonly to_wall: number;
  readonly body: BodyInfo;
  readonly users: readonly RoomUser[];
  /** Token with which this client comes back; absent if it needs none. */
  readonly session?: string;
}

export interface Watching {
  readonly type: "watching";
  readonly protocol: number;
  readonly simulation_period: number;
  readonly to_wall: number;
  readonly body: BodyInfo;
  readonly model: string | null;
  readonly users: readonly RoomUser[];
  readonly allow_latency: boolean;
  readonly allow_fixed_gains: boolean;
  readonly allow_upload: boolean;
  readonly can_touch: boolean;
  readonly room_admin: boolean;
  readonly can_record: boolean;
  readonly session?: string;
}

/** Not there if the user's client said nothing of it. */
interface Ruled {
  readonly rules?: LoopRules;
}

export type ServerControl =
  | Welcome
  | Watching
  | { readonly type: "place"; readonly place: number; readonly of: number; readonly session?: string }
  | { readonly type: "called"; readonly within: number }
  | { readonly type: "named"; readonly name: string; readonly reason: string }
  | ({ readonly type: "user_joined" } & RoomUser)
  | { readonly type: "user_left"; readonly user: number; readonly name: string; readonly reason: string }
  | { readonly type: "latency"; readonly user: number; readonly delay: number; readonly jitter: number; readonly network: string }
  | { readonly type: "restraints"; readonly frozen: boolean; readonly muted: readonly number[] }
  | { readonly type: "recorded"; readonly on: boolean }
  | { readonly type: "moderated"; readonly action: string; readonly user: number | null; readonly done: boolean }
  | { readonly type: "put_out"; readonly names: readonly string[] }
  | ({ readonly type: "company" } & Company)
  | ({ readonly type: "aimed"; readonly user: number } & Aim)
  | { readonly type: "pointed"; readonly user: number | null; readonly name: string; readonly point: Vec3 }
  | { readonly type: "declined"; readonly what: string; readonly reason: string }
  | { readonly type: "error"; readonly code: number; readonly field: string; readonly message: string };

export function encodeControl(message: ClientControl): string {
  return JSON.stringify(message);
}

/** Decode a message of the server; any invalid text throws ProtocolError. */
export function decodeServerControl(said: string): ServerControl {
  const fields = parseFields(said, MAX_SERVER_TEXT);
  const type = text(fields, "type");
  const decode = DECODERS.get(type);
  if (decode === undefined) {
    throw new ProtocolError("type of a control message", type, [...DECODERS.keys()].join(", "));
  }
  const message = decode(fields);
  checkKeys(type, fields, Object.keys(message));
  return message;
}

const DECODERS: ReadonlyMap<string, (fields: Fields) => ServerControl> = new Map([
  ["welcome", welcome],
  ["watching", watching],
  ["place", (f: Fields): ServerControl => ({ type: "place", place: integer(f, "place"), of: integer(f, "of"), ...session(f) })],
  ["called", (f: Fields): ServerControl => ({ type: "called", within: positive(f, "within", MAX_TURN) })],
  ["named", (f: Fields): ServerControl => ({ type: "named", name: text(f, "name"), reason: text(f, "reason") })],
  ["user_joined", (f: Fields): ServerControl => ({ type: "user_joined", ...roomUser(f) })],
  ["user_left", (f: Fields): ServerControl => ({ type: "user_left", user: integer(f, "user"), name: text(f, "name"), reason: text(f, "reason") })],
  [
    "latency",
    (f: Fields): ServerControl => ({
      type: "latency",
      user: integer(f, "user"),
      delay: number(f, "delay", 0, 10),
      jitter: number(f, "jitter", 0, 10),
      network: text(f, "network"),
    }),
  ],
  ["restraints", (f: Fields): ServerControl => ({ type: "restraints", frozen: flag(f, "frozen"), muted: integers(f, "muted") })],
  ["recorded", (f: Fields): ServerControl => ({ type: "recorded", on: flag(f, "on") })],
  ["moderated", (f: Fields): ServerControl => ({ type: "moderated", action: text(f, "action"), user: somebody(f), done: flag(f, "done") })],
  ["put_out", (f: Fields): ServerControl => ({ type: "put_out", names: texts(f, "names") })],
  [
    "company",
    (f: Fields): ServerControl => ({
      type: "company",
      watching: integer(f, "watching"),
      open: integers(f, "open"),
      following: f["following"] === null ? null : integer(f, "following"),
      followers: objects(f, "followers", (one) => ({ user: somebody(one), name: text(one, "name") })),
      may_point: flag(f, "may_point"),
    }),
  ],
  [
    "aimed",
    (f: Fields): ServerControl => ({
      type: "aimed",
      user: integer(f, "user"),
      azimuth: number(f, "azimuth", -7, 7),
      elevation: number(f, "elevation", -1.6, 1.6),
      distance: number(f, "distance", 1, 50),
    }),
  ],
  ["pointed", (f: Fields): ServerControl => ({ type: "pointed", user: somebody(f), name: text(f, "name"), point: vector(f, "point", MAX_POSITION) })],
  ["declined", (f: Fields): ServerControl => ({ type: "declined", what: text(f, "what"), reason: text(f, "reason") })],
  ["error", (f: Fields): ServerControl => ({ type: "error", code: integer(f, "code"), field: text(f, "field"), message: text(f, "message") })],
]);

function welcome(f: Fields): Welcome {
  return {
    type: "welcome",
    protocol: version(f),
    user: integer(f, "user"),
    name: text(f, "name"),
    ...room(f),
  };
}

/** What a room says to those who touch and to those who watch. */
function room(f: Fields): Pick<Welcome, "simulation_period" | "to_wall" | "body" | "users" | "session"> {
  return {
    simulation_period: number(f, "simulation_period", MIN_PERIOD, MAX_PERIOD),
    to_wall: number(f, "to_wall", -1e12, 1e12),
    body: bodyInfo(object(f, "body")),
    users: objects(f, "users", roomUser),
    ...session(f),
  };
}

/** Number of a user; null for no particular user. */
function somebody(f: Fields): number | null {
  return f["user"] === null ? null : integer(f, "user");
}

function integers(f: Fields, key: string): readonly number[] {
  return list(f, key).map((_, i, all) => integer(Object.fromEntries(all.entries()), `${i}`));
}

function texts(f: Fields, key: string): readonly string[] {
  return list(f, key).map((name, i) => {
    if (typeof name !== "string") throw new ProtocolError(`${key}.${i}`, name, "text");
    return name;
  });
}

function objects<T>(f: Fields, key: string, read: (one: Fields) => T): readonly T[] {
  return list(f, key).map((one, i) => {
    if (!isFields(one)) throw new ProtocolError(`${key}.${i}`, one, "an object");
    return read(one);
  });
}

function roomUser(f: Fields): RoomUser {
  return { user: integer(f, "user"), name: text(f, "name"), ...rules(f) };
}

function watching(f: Fields): Watching {
  return {
    type: "watching",
    protocol: version(f),
    ...room(f),
    model: f["model"] === null ? null : modelName(text(f, "model")),
    allow_latency: flag(f, "allow_latency"),
    allow_fixed_gains: flag(f, "allow_fixed_gains"),
    allow_upload: flag(f, "allow_upload"),
    can_touch: flag(f, "can_touch"),
    room_admin: flag(f, "room_admin"),
    can_record: flag(f, "can_record"),
  };
}

function rules(f: Fields): Ruled {
  if (f["rules"] === undefined) return {};
  const said = object(f, "rules");
  return { rules: { added: texts(said, "added"), lacking: texts(said, "lacking") } };
}

/** Token of a session; the page only sends it back to the server unchanged. */
function session(f: Fields): { readonly session?: string } {
  if (f["session"] === undefined) return {};
  const token = text(f, "session");
  if (!/^[!-~]{1,2048}$/.test(token)) throw new ProtocolError("session", "not shown", "a token");
  return { session: token };
}

function version(f: Fields): number {
  const theirs = integer(f, "protocol");
  if (theirs !== PROTOCOL_VERSION) {
    throw new ProtocolError("protocol version", theirs, `${PROTOCOL_VERSION}: reload the page`);
  }
  return theirs;
}

/** Check the name of a model: it becomes part of an address, so it must consist of the digits of a hash. */
function modelName(model: string): string {
  if (!/^[0-9a-f]{1,128}$/.test(model)) throw new ProtocolError("model", model, "hexadecimal digits");
  return model;
}

function bodyInfo(f: Fields): BodyInfo {
  const name = text(f, "name");
  if (Array.from(name).length > MAX_BODY_NAME) throw new ProtocolError("name", name, `at most ${MAX_BODY_NAME} characters`);
  return {
    name,
    center: vector(f, "center", MAX_POSITION),
    radius: positive(f, "radius", MAX_POSITION),
    contact_radius: positive(f, "contact_radius", MAX_POSITION),
  };
}
