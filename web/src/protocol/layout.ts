// Made by `make protocol` from shared/cohaptic/protocol/layout.py: change that table instead.

/**
 * The layout of every binary frame and of its parts: sizes, offsets of fields from the beginning,
 * and functions that read and write the fields; the values are not checked.
 */

import type { Vec3 } from "../model/vec";
import { getFloat16, getVec, setVec } from "./numbers";

export const PROTOCOL_VERSION = 6;
export const SUBPROTOCOL = "cohaptic.v6";

/** Second byte of every binary frame. */
export const Kind = { contact_sample: 1, patch: 2, rest_mesh: 3, scene: 4, ack: 5, rows: 6 } as const;
export const HEAD_SIZE = 4;

export const MAX_POSITION = 10; // m
export const MAX_FORCE = 100; // N
export const MAX_STIFFNESS = 1000000; // N/m
export const MIN_COMPLIANCE = 1e-06; // m/N, of fixed and rigid parts
export const MAX_CURVATURE = 10000; // 1/m, of a patch
export const MAX_LAG = 60; // s
export const MAX_COUPLING = 1000;
export const MAX_NEIGHBOURS = 97;
export const MAX_VERTICES = 65535; // of a rest mesh
export const MAX_FACES = 131070;
export const MAX_MESH_BYTES = 1575436;
export const MESH_STEPS = 65535; // on each axis of a quantised mesh
export const MAX_USERS = 256;
export const MAX_GAIN_CUT = 60000; // N/m, in a tick's ledger
export const MAX_USER_CURVATURE = 60000; // 1/m, in a scene
export const MAX_LOOP_DELAY = 1000; // s

export const CONTACT_SAMPLE_SIZE = 44;
export const CONTACT_SAMPLE_AT = { seq: 4, tick: 8, t_client: 12, probe: 20, force: 32 } as const;

/** Position of the tip, and force on the hand. */
export interface ContactSampleFields {
  /** counts this client's samples, rising; >= 1 */ readonly seq: number;
  /** newest patch that the client used; 0 for none */ readonly tick: number;
  /** when it was taken, client's clock [s]; finite */ readonly t_client: number;
  /** tip, world frame [m]; length <= 10 */ readonly probe: Vec3;
  /** on the hand, world frame [N]; length <= 100 */ readonly force: Vec3;
}

export function readContactSampleFields(view: DataView): ContactSampleFields {
  return {
    seq: view.getUint32(4, true),
    tick: view.getUint32(8, true),
    t_client: view.getFloat64(12, true),
    probe: getVec(view, 20),
    force: getVec(view, 32),
  };
}

export function writeContactSampleFields(view: DataView, fields: ContactSampleFields): void {
  view.setUint32(4, fields.seq, true);
  view.setUint32(8, fields.tick, true);
  view.setFloat64(12, fields.t_client, true);
  setVec(view, 20, fields.probe);
  setVec(view, 32, fields.force);
}

export const ANCHOR_SIZE = 12;

/** Behind a contact sample with friction and in contact: point of the resting surface that the finger holds, world frame [m]; length <= 10 */
export function readAnchor(view: DataView, at: number): Vec3 {
  return getVec(view, at);
}

export function writeAnchor(view: DataView, at: number, anchor: Vec3): void {
  setVec(view, at, anchor);
}

export const DEFLECTION_SIZE = 4;

/** Behind a contact sample of a client that moves models of the hands, or simulates its own: displacement of the model of this client's own hand, out of the body, by the forces on the hand before `t_client` [m]; +-10 */
export function readDeflection(view: DataView, at: number): number {
  return view.getFloat32(at, true);
}

export function writeDeflection(view: DataView, at: number, deflection: number): void {
  view.setFloat32(at, deflection, true);
}

export const OWN_MODEL_SIZE = 12;
export const OWN_MODEL_AT = { mass: 0, damping: 4, stiffness: 8 } as const;

/** Behind the deflection of a client that simulates its own hand: the hand itself. */
export interface OwnModelFields {
  /** of the model [kg]; 0.03..0.8 */ readonly mass: number;
  /** of the model [N s/m]; 0.5..100 */ readonly damping: number;
  /** of the model [N/m]; 50..1e4 */ readonly stiffness: number;
}

export function readOwnModelFields(view: DataView, at: number): OwnModelFields {
  return {
    mass: view.getFloat32(at, true),
    damping: view.getFloat32(at + 4, true),
    stiffness: view.getFloat32(at + 8, true),
  };
}

export function writeOwnModelFields(view: DataView, at: number, fields: OwnModelFields): void {
  view.setFloat32(at, fields.mass, true);
  view.setFloat32(at + 4, fields.damping, true);
  view.setFloat32(at + 8, fields.stiffness, true);
}

export const PATCH_SIZE = 116;
export const PATCH_AT = { tick: 4, seq: 8, t_server: 12, t_client: 20, sample_wait: 28, x_free: 32, normal: 44, curvature: 56, c_ii: 60, k_h: 64, integral_gain: 68, own_force: 72, u_others: 84, lag: 96, coupling: 100, margin: 102, by_presence: 104, by_limit: 106, by_anticipation: 108, by_lag: 110, by_rate: 112, gain_cut: 114 } as const;

/** Surface in front of one user, free of the user's own force, and gains of the law. */
export interface PatchFields {
  /** simulation tick, rising; >= 1 */ readonly tick: number;
  /** contact sample contained in this surface; 0 for none */ readonly seq: number;
  /** time of the tick, server's clock [s]; finite */ readonly t_server: number;
  /** `t_client` of that sample, sent back [s]; finite */ readonly t_client: number;
  /** how long that sample waited for the tick [s]; 0..1e6 */ readonly sample_wait: number;
  /** contact point without this client's own force [m]; length <= 10 */ readonly x_free: Vec3;
  /** outward unit normal there [1]; length 1 to 0.1 % */ readonly normal: Vec3;
  /** of the free surface round the contact; 0 for a plane [1/m]; +-1e4 */ readonly curvature: number;
  /** compliance of the contact; K_o alone is 1 / c_ii [m/N]; 1e-6..10 */ readonly c_ii: number;
  /** gain that the server chose for this client's law [N/m]; 0..1e6 */ readonly k_h: number;
  /** I of the law `pi`; 0 for the others [N/(m s)]; 0..1e9 */ readonly integral_gain: number;
  /** on this hand, world frame, that the body carries at this tick, behind the room's lag; the body gets its opposite [N]; length <= 100 */ readonly own_force: Vec3;
  /** displacement of the material under the contact by the others, world frame [m]; length <= 10 */ readonly u_others: Vec3;
  readonly room: {
    /** tau of the room (`science.md` 3.8, 3.13); 0 for none [s]; 0..60 */ readonly lag: number;
    /** m of the room, the spectral radius of S [1]; 0..1e3 */ readonly coupling: number;
    /** where forces are anticipated, 1 over the share of an error that is left after one way round; else tau over the least that is stable, 1 / m for m < 1; 6e4 for hands that do not couple [1]; >= 0 */ readonly margin: number;
  };
  readonly ledger: {
    /** what the tick adds to the force that it had heard of: who comes, leaves, is silent, has jumped or is too high above the surface [N]; +-300 */ readonly by_presence: number;
    /** the same: by the limits of the contact and of the body [N]; +-300 */ readonly by_limit: number;
    /** the same: since the answers of the other hands are anticipated [N]; +-300 */ readonly by_anticipation: number;
    /** the same: by the room's lag [N]; +-300 */ readonly by_lag: number;
    /** the same: since the force on another hand would change too fast [N]; +-300 */ readonly by_rate: number;
    /** what the gain `k_h` is less since models of others stiffen the contact; 6e4 for more [N/m]; 0..6e4 */ readonly gain_cut: number;
  };
}

export function readPatchFields(view: DataView): PatchFields {
  return {
    tick: view.getUint32(4, true),
    seq: view.getUint32(8, true),
    t_server: view.getFloat64(12, true),
    t_client: view.getFloat64(20, true),
    sample_wait: view.getFloat32(28, true),
    x_free: getVec(view, 32),
    normal: getVec(view, 44),
    curvature: view.getFloat32(56, true),
    c_ii: view.getFloat32(60, true),
    k_h: view.getFloat32(64, true),
    integral_gain: view.getFloat32(68, true),
    own_force: getVec(view, 72),
    u_others: getVec(view, 84),
    room: {
      lag: view.getFloat32(96, true),
      coupling: getFloat16(view, 100),
      margin: getFloat16(view, 102),
    },
    ledger: {
      by_presence: getFloat16(view, 104),
      by_limit: getFloat16(view, 106),
      by_anticipation: getFloat16(view, 108),
      by_lag: getFloat16(view, 110),
      by_rate: getFloat16(view, 112),
      gain_cut: getFloat16(view, 114),
    },
  };
}

export const COMPLIANCE_SIZE = 24;

/** Behind a patch for a client with friction: of the contact in all directions, world frame: xx yy zz xy xz yz [m/N]; each +-10; positive definite */
export function readCompliance(view: DataView, at: number): readonly [number, number, number, number, number, number] {
  return [...getVec(view, at), ...getVec(view, at + 12)];
}

export const PARTNERS_SIZE = 24;
export const PARTNERS_AT = { count: 0, weight: 4, max_force: 8, mass: 12, damping: 16, stiffness: 20 } as const;

/** Behind a patch and its compliance, for a client that moves models of the hands (`science.md` 3.15). */
export interface PartnersFields {
  /** partners that follow; <= 7 */ readonly count: number;
  /** share of the models' forces; the rest is that of the forces in this surface [1]; 0..1 */ readonly weight: number;
  /** largest force of this client on the body [N]; 0..100 */ readonly max_force: number;
  /** of the model [kg]; 0.03..0.8 */ readonly mass: number;
  /** of the model [N s/m]; 0.5..100 */ readonly damping: number;
  /** of the model [N/m]; 50..1e4 */ readonly stiffness: number;
}

export function readPartnersFields(view: DataView, at: number): PartnersFields {
  return {
    count: view.getUint16(at, true),
    weight: view.getFloat32(at + 4, true),
    max_force: view.getFloat32(at + 8, true),
    mass: view.getFloat32(at + 12, true),
    damping: view.getFloat32(at + 16, true),
    stiffness: view.getFloat32(at + 20, true),
  };
}

export const PARTNER_SIZE = 36;
export const PARTNER_AT = { user: 0, mass: 4, damping: 8, stiffness: 12, intended: 16, deflection: 20, force: 24, max_force: 28, c_jj: 32 } as const;

/** Another hand: its contact, what it wants, and its model. Its row of the compliance follows. */
export interface PartnerFields {
  /** its number; >= 1 */ readonly user: number;
  /** of the model [kg]; 0.03..0.8 */ readonly mass: number;
  /** of the model [N s/m]; 0.5..100 */ readonly damping: number;
  /** of the model [N/m]; 50..1e4 */ readonly stiffness: number;
  /** depth of its tip below the surface without any force, plus its `deflection` [m]; +-20 */ readonly intended: number;
  /** the `deflection` that its client reports [m]; +-10 */ readonly deflection: number;
  /** of this hand along its normal, in this surface [N]; 0..300 */ readonly force: number;
  /** largest force of this hand [N]; 0..100 */ readonly max_force: number;
  /** compliance of its contact and its device [m/N]; 1e-6..10 */ readonly c_jj: number;
}

export function readPartnerFields(view: DataView, at: number): PartnerFields {
  return {
    user: view.getUint32(at, true),
    mass: view.getFloat32(at + 4, true),
    damping: view.getFloat32(at + 8, true),
    stiffness: view.getFloat32(at + 12, true),
    intended: view.getFloat32(at + 16, true),
    deflection: view.getFloat32(at + 20, true),
    force: view.getFloat32(at + 24, true),
    max_force: view.getFloat32(at + 28, true),
    c_jj: view.getFloat32(at + 32, true),
  };
}

export const COUPLED_SIZE = 4;

/** Behind a partner, for this client's contact and for each partner before it: compliance between both contacts, along their normals [m/N]; +-10 */
export function readCoupled(view: DataView, at: number): number {
  return view.getFloat32(at, true);
}

export const NEIGHBOURHOOD_SIZE = 10;
export const NEIGHBOURHOOD_AT = { count: 0, scale: 2, c_scale: 6 } as const;

/** Behind a mesh patch, its compliance and its partners: the free surface round the contact. */
export interface NeighbourhoodFields {
  /** neighbours that follow; the frame ends with the last; <= 97 */ readonly count: number;
  /** one unit of the displacements [m]; 0..10/32767 */ readonly scale: number;
  /** one unit of the compliances [m/N]; 0..10/65535 */ readonly c_scale: number;
}

export function readNeighbourhoodFields(view: DataView, at: number): NeighbourhoodFields {
  return {
    count: view.getUint16(at, true),
    scale: view.getFloat32(at + 2, true),
    c_scale: view.getFloat32(at + 6, true),
  };
}

export const NEIGHBOUR_SIZE = 10;
export const NEIGHBOUR_AT = { indices: 0, displacements: 2, compliances: 8 } as const;

/** One vertex of a neighbourhood. */
export interface NeighbourFields {
  /** vertex of the rest mesh; more than the one before; below its vertices */ readonly indices: number;
  /** from the rest mesh, world frame [scale] */ readonly displacements: Vec3;
  /** of a contact centred at the vertex [c_scale] */ readonly compliances: number;
}

export function readNeighbourFields(view: DataView, at: number): NeighbourFields {
  return {
    indices: view.getUint16(at, true),
    displacements: [view.getInt16(at + 2, true), view.getInt16(at + 4, true), view.getInt16(at + 6, true)],
    compliances: view.getUint16(at + 8, true),
  };
}

export const REST_MESH_SIZE = 12;
export const REST_MESH_AT = { vertices: 4, faces: 8 } as const;

/** Resting surface of the body, exact or quantised. */
export interface RestMeshFields {
  /** how many; 3..65535 */ readonly vertices: number;
  /** how many; 1..131070 */ readonly faces: number;
}

export function readRestMeshFields(view: DataView): RestMeshFields {
  return {
    vertices: view.getUint32(4, true),
    faces: view.getUint32(8, true),
  };
}

export const VERTEX_SIZE = 12;

export const FACE_SIZE = 6;

export const BOX_SIZE = 24;
export const BOX_AT = { low: 0, unit: 12 } as const;

/** Behind the numbers of a quantised mesh. */
export interface BoxFields {
  /** corner of the bounding box with the smallest coordinates [m]; each +-10 */ readonly low: Vec3;
  /** of each axis: the length of the box over 65,535; 0 where it is flat [m]; the box ends at 10 */ readonly unit: Vec3;
}

export function readBoxFields(view: DataView, at: number): BoxFields {
  return {
    low: getVec(view, at),
    unit: getVec(view, at + 12),
  };
}

export const SCENE_SIZE = 28;
export const SCENE_AT = { tick: 4, t_server: 8, users: 16, lag: 20, coupling: 24, margin: 26 } as const;

/** All users at one tick, and the surface where it is asked for. */
export interface SceneFields {
  /** simulation tick, rising; >= 1 */ readonly tick: number;
  /** time of the tick, server's clock [s]; finite */ readonly t_server: number;
  /** records that follow; <= 256 */ readonly users: number;
  readonly room: {
    /** of the room, as in a patch [s]; 0..60 */ readonly lag: number;
    /** of the room, as in a patch [1]; 0..1e3 */ readonly coupling: number;
    /** of the room, as in a patch [1]; >= 0 */ readonly margin: number;
  };
}

export function readSceneFields(view: DataView): SceneFields {
  return {
    tick: view.getUint32(4, true),
    t_server: view.getFloat64(8, true),
    users: view.getUint16(16, true),
    room: {
      lag: view.getFloat32(20, true),
      coupling: getFloat16(view, 24),
      margin: getFloat16(view, 26),
    },
  };
}

export const USER_SIZE = 86;
export const USER_AT = { user: 0, probe: 4, foot: 16, force: 28, c_ii: 40, k_o_coupled: 42, k_h: 46, integral_gain: 50, loop_delay: 54, normal: 56, shape: 62, presence: 63, curvature: 64, state: 66, to_free: 68, by_presence: 74, by_limit: 76, by_anticipation: 78, by_lag: 80, by_rate: 82, gain_cut: 84 } as const;

/** One user in a scene. */
export interface UserFields {
  /** its number; >= 1 */ readonly user: number;
  /** tip, world frame [m]; length <= 10 */ readonly probe: Vec3;
  /** centre of its pressure, on the facets of the *resting* mesh [m]; length <= 10 */ readonly foot: Vec3;
  /** that the body carries, behind the room's lag, as it acts on the hand; the body gets its opposite [N]; length <= 300 */ readonly force: Vec3;
  /** compliance of the contact; 0 for one who has left, as the next three [m/N]; 0..10 */ readonly c_ii: number;
  /** coupling-aware, 1 / sum_j |C_ij|: the bound of the paper's laws [N/m]; 0..1e6 */ readonly k_o_coupled: number;
  /** as in a patch [N/m]; 0..1e6 */ readonly k_h: number;
  /** as in a patch [N/(m s)]; 0..1e9 */ readonly integral_gain: number;
  /** of its loop, as measured; 0 before the first measurement [s]; 0..1e3 */ readonly loop_delay: number;
  /** outward unit normal of the free surface at the contact; length 1 to 0.1 % */ readonly normal: Vec3;
  /** bits 0-3 `geometry`: 1 plane, 2 sphere, 3 mesh; bits 4-7 `law`: 1 proportional, 2 pi, 3 predictive; 1..3, 1..3 */ readonly shape: number;
  /** share of its force that the body carries */ readonly presence: number;
  /** of its patch, positive where the body bulges [1/m]; +-6e4 */ readonly curvature: number;
  /** bit 0 `fresh`: its samples still come; bit 1 `friction`: its force may have a part along the surface; 0..3 */ readonly state: number;
  /** from the tip to the contact point of the surface without this user's own force [m]; length <= 10 */ readonly to_free: Vec3;
  readonly ledger: {
    /** of the tick, as in a patch [N]; +-300 */ readonly by_presence: number;
    /** of the tick, as in a patch [N]; +-300 */ readonly by_limit: number;
    /** of the tick, as in a patch [N]; +-300 */ readonly by_anticipation: number;
    /** of the tick, as in a patch [N]; +-300 */ readonly by_lag: number;
    /** of the tick, as in a patch [N]; +-300 */ readonly by_rate: number;
    /** of the tick, as in a patch [N/m]; 0..6e4 */ readonly gain_cut: number;
  };
}

export function readUserFields(view: DataView, at: number): UserFields {
  return {
    user: view.getUint32(at, true),
    probe: getVec(view, at + 4),
    foot: getVec(view, at + 16),
    force: getVec(view, at + 28),
    c_ii: getFloat16(view, at + 40),
    k_o_coupled: view.getFloat32(at + 42, true),
    k_h: view.getFloat32(at + 46, true),
    integral_gain: view.getFloat32(at + 50, true),
    loop_delay: getFloat16(view, at + 54),
    normal: [view.getInt16(at + 56, true) / 32767, view.getInt16(at + 58, true) / 32767, view.getInt16(at + 60, true) / 32767],
    shape: view.getUint8(at + 62),
    presence: view.getUint8(at + 63) / 255,
    curvature: getFloat16(view, at + 64),
    state: view.getUint8(at + 66),
    to_free: [getFloat16(view, at + 68), getFloat16(view, at + 70), getFloat16(view, at + 72)],
    ledger: {
      by_presence: getFloat16(view, at + 74),
      by_limit: getFloat16(view, at + 76),
      by_anticipation: getFloat16(view, at + 78),
      by_lag: getFloat16(view, at + 80),
      by_rate: getFloat16(view, at + 82),
      gain_cut: getFloat16(view, at + 84),
    },
  };
}

export const SURFACE_SIZE = 8;
export const SURFACE_AT = { scale: 0, length: 4 } as const;

/** Behind the users of a scene with flag bit 0: displacements of all vertices. */
export interface SurfaceFields {
  /** one unit of a displacement: 1e-5, or more where that does not fit [m]; above 0, at most 0.1 */ readonly scale: number;
  /** of the zlib stream that follows; the frame ends with it */ readonly length: number;
}

export function readSurfaceFields(view: DataView, at: number): SurfaceFields {
  return {
    scale: view.getFloat32(at, true),
    length: view.getUint32(at + 4, true),
  };
}

export const ACK_SIZE = 12;
export const ACK_AT = { tick: 4, wants: 8 } as const;

/** The client has received and drawn a scene. */
export interface AckFields {
  /** of the newest scene that came; >= 1 */ readonly tick: number;
  /** 1: scenes with the surface until the next ack, whatever the encoding, since Green's functions are missing; 0: as the encoding says; 0, 1 */ readonly wants: number;
}

export function writeAckFields(view: DataView, fields: AckFields): void {
  view.setUint32(4, fields.tick, true);
  view.setUint8(8, fields.wants);
}

export const ROWS_SIZE = 34;
export const ROWS_AT = { count: 4, lost: 6, to_server: 10, error: 18, round_trip: 26, jitter: 30 } as const;

/** Rows of the client's haptic loop, while the session is recorded. */
export interface RowsFields {
  /** number of rows; 1..64 */ readonly count: number;
  /** rows that were left out since the last batch, as the link was busy */ readonly lost: number;
  /** the server's clock less the client's [s]; +-1e9 */ readonly to_server: number;
  /** bound on its error [s]; >= 0 */ readonly error: number;
  /** mean round trip [s]; >= 0 */ readonly round_trip: number;
  /** mean deviation from it [s]; >= 0 */ readonly jitter: number;
}

export function readRowsFields(view: DataView): RowsFields {
  return {
    count: view.getUint16(4, true),
    lost: view.getUint32(6, true),
    to_server: view.getFloat64(10, true),
    error: view.getFloat64(18, true),
    round_trip: view.getFloat32(26, true),
    jitter: view.getFloat32(30, true),
  };
}
