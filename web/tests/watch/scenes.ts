/** Scenes and their frames for tests; input of the page's decoders. */

import { zlibSync } from "fflate";
import type { RestMesh } from "../../src/model/body";
import { sub } from "../../src/model/vec";
import { newFrame } from "../../src/protocol/frame";
import { REST_MESH_AT, REST_MESH_SIZE, SCENE_AT, SCENE_SIZE, SURFACE_AT, SURFACE_SIZE, USER_AT, USER_SIZE } from "../../src/protocol/layout";
import type { UserRecord } from "../../src/protocol/scene";
import { traversalOf } from "../../src/protocol/traversal";
import { NOTHING_CUT } from "../users";

/** A tetrahedron of 0.1 m. */
export const MESH: RestMesh = {
  vertices: Float32Array.from([0.1, 0, 0, -0.1, 0, 0, 0, 0.1, 0, 0, 0, 0.1]),
  faces: Uint32Array.from([0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3]),
};
export const N = 4;

export function record(user: number, x = 0): UserRecord {
  return {
    user,
    probe: [x, 0, 0],
    foot: [0.1, 0, 0],
    force: [1, 0, 0],
    c_ii: 0.004,
    k_o_coupled: 200,
    k_h: 250,
    integral_gain: 0,
    loop_delay: 0.05,
    normal: [1, 0, 0],
    law: "predictive",
    geometry: "plane",
    presence: 1,
    curvature: 0,
    fresh: true,
    friction: false,
    x_free: [0.1, 0, 0],
    ledger: NOTHING_CUT,
  };
}

/** The frame of a rest mesh. */
export function meshFrame({ vertices, faces }: RestMesh): Uint8Array {
  const raw = new Uint8Array(4 * vertices.length + 2 * faces.length);
  raw.set(new Uint8Array(vertices.buffer));
  raw.set(new Uint8Array(Uint16Array.from(faces).buffer), 4 * vertices.length);
  const stream = zlibSync(raw);
  const head = newFrame("rest_mesh", REST_MESH_SIZE + stream.length);
  head.setUint32(REST_MESH_AT.vertices, vertices.length / 3, true);
  head.setUint32(REST_MESH_AT.faces, faces.length / 3, true);
  const frame = new Uint8Array(head.buffer);
  frame.set(stream, REST_MESH_SIZE);
  return frame;
}

/** The frame of a scene; with a surface where all vertices have moved by `units` along x, in 10 um. */
export function sceneFrame(tick: number, t_server: number, users: readonly UserRecord[], units: number | null, lag = 0): Uint8Array {
  const surface = units === null ? new Uint8Array() : surfaceTail(units);
  const view = newFrame("scene", SCENE_SIZE + USER_SIZE * users.length + surface.length, units === null ? 0 : 1);
  view.setUint32(SCENE_AT.tick, tick, true);
  view.setFloat64(SCENE_AT.t_server, t_server, true);
  view.setUint16(SCENE_AT.users, users.length, true);
  view.setFloat32(SCENE_AT.lag, lag, true);
  view.setUint16(SCENE_AT.coupling, 0x3800, true); // m = 0.5
  view.setUint16(SCENE_AT.margin, 0x4000, true); // margin 2
  users.forEach((user, i) => {
    writeUser(new DataView(view.buffer, SCENE_SIZE + USER_SIZE * i, USER_SIZE), user);
  });
  const frame = new Uint8Array(view.buffer);
  frame.set(surface, SCENE_SIZE + USER_SIZE * users.length);
  return frame;
}

function writeUser(view: DataView, user: UserRecord): void {
  view.setUint32(USER_AT.user, user.user, true);
  [...user.probe, ...user.foot, ...user.force].forEach((value, i) => {
    view.setFloat32(USER_AT.probe + 4 * i, value, true);
  });
  [user.k_o_coupled, user.k_h, user.integral_gain].forEach((value, i) => {
    view.setFloat32(USER_AT.k_o_coupled + 4 * i, value, true);
  });
  view.setUint16(USER_AT.c_ii, half(user.c_ii), true);
  view.setUint16(USER_AT.loop_delay, half(user.loop_delay), true);
  user.normal.forEach((value, i) => {
    view.setInt16(USER_AT.normal + 2 * i, Math.round(32767 * value), true);
  });
  view.setUint8(USER_AT.shape, (3 << 4) | 1);
  view.setUint8(USER_AT.presence, Math.round(255 * user.presence));
  view.setUint8(USER_AT.state, 1);
  sub(user.x_free, user.probe).forEach((value, i) => {
    view.setUint16(USER_AT.to_free + 2 * i, half(value), true);
  });
}

/** Bits of the half float that is nearest to a number of ordinary size. */
function half(value: number): number {
  const size = Math.abs(value);
  if (size < 2 ** -14) return (value < 0 ? 0x8000 : 0) | Math.round(size * 2 ** 24);
  const exponent = Math.floor(Math.log2(size));
  return (value < 0 ? 0x8000 : 0) + ((exponent + 15) << 10) + Math.round((size / 2 ** exponent - 1) * 1024);
}

/** The same displacement everywhere: the first vertex has it, the prediction gives the rest. */
function surfaceTail(units: number): Uint8Array {
  const { foretold } = traversalOf(N, MESH.faces);
  const raw = new Uint8Array(6 * N);
  for (let k = 0; k < N; k += 1) {
    const nothing = foretold[3 * k] === N;
    const step = nothing ? units : 0;
    const z = ((step << 1) ^ (step >> 15)) & 0xffff;
    raw[k] = z & 255;
    raw[3 * N + k] = z >> 8;
  }
  const stream = zlibSync(raw);
  const tail = new Uint8Array(SURFACE_SIZE + stream.length);
  const view = new DataView(tail.buffer);
  view.setFloat32(SURFACE_AT.scale, 1e-5, true);
  view.setUint32(SURFACE_AT.length, stream.length, true);
  tail.set(stream, SURFACE_SIZE);
  return tail;
}

export const WATCHING = {
  type: "watching",
  protocol: 6,
  simulation_period: 1 / 60,
  to_wall: 0,
  body: { name: "balloon", center: [0, 0, 0], radius: 0.1, contact_radius: 0.02 },
  model: "0123456789abcdef0123456789abcdef",
  users: [{ user: 1, name: "ana" }],
  allow_latency: true,
  allow_fixed_gains: false,
  allow_upload: false,
  can_touch: true,
  room_admin: false,
  can_record: false,
};
