/**
 * The scene: all users and the surface, as the page watches them.
 *
 * Names of quantities are those of the wire and of `docs/notation.md`; SI everywhere, mm and ms only on screen. Times
 * are in seconds on the page's clock, `performance.now() / 1000`, unless a name says otherwise; `now` is an argument.
 * Text from others (names, reasons) is inserted as text, never as markup.
 */

import type { BodyInfo, RestMesh, RoomLag } from "./body";
import type { GeometryName, LawName } from "./laws";
import type { CompanyLink } from "./company";
import type { Order, Restraints } from "./orders";
import type { RecordedSession, Recording } from "./recording";
import type { Subscribe } from "./subscribe";
import type { Vec3 } from "./vec";

/** Injected network, each way: delay and largest extra delay [s], and the words for losses and stalls, which name a network. */
export interface Latency {
  readonly delay: number;
  readonly jitter: number;
  readonly network: string;
}

/** A network that is asked for; what is left out is the network's own. */
export type LatencyWish = Partial<Omit<Latency, "network">> & Pick<Latency, "network">;

/** Difference of a user's loop from the rules of this version. */
export interface LoopRules {
  readonly added: readonly string[];
  readonly lacking: readonly string[];
}

/** What the server's tick added to the force that it had heard of, in newtons; and what the law's gain is less [N/m]. */
export interface TickLedger {
  readonly by_presence: number;
  readonly by_limit: number;
  readonly by_anticipation: number;
  readonly by_lag: number;
  readonly by_rate: number;
  readonly gain_cut: number;
}

/** One user, as the server has it at the time shown. */
export interface UserState {
  readonly user: number;
  /** Empty until the page has heard it. */
  readonly name: string;
  /** Tip of the device [m]. */
  readonly probe: Vec3;
  /** Point of the *resting* facets that is pressed [m]. */
  readonly foot: Vec3;
  /** Contact point of the surface free of this user's own force [m]. */
  readonly x_free: Vec3;
  /** Outward unit normal at the contact point. */
  readonly normal: Vec3;
  /** Force on the hand, world frame; the body carries its opposite [N]. */
  readonly force: Vec3;
  /** Compliance of the contact [m/N]; 0 after the user has left, like the next four. */
  readonly c_ii: number;
  /** Stiffness of the body with the coupling of all hands, which limits the gains of the paper's laws [N/m]. */
  readonly k_o_coupled: number;
  /** Gains that the server chose [N/m], [N/(m s)]. */
  readonly k_h: number;
  readonly integral_gain: number;
  /** Measured delay of the whole loop [s]. */
  readonly loop_delay: number;
  /** What the tick made of the user's force. */
  readonly ledger: TickLedger;
  /** Difference of the user's loop from the rules of this version; null if it said none. */
  readonly rules: LoopRules | null;
  /** Curvature of the patch [1/m]. */
  readonly curvature: number;
  readonly law: LawName;
  readonly geometry: GeometryName;
  /** Whether samples of this user still arrive. */
  readonly fresh: boolean;
  /** Whether the user's force may have a part along the surface. */
  readonly friction: boolean;
  /** 1 while present; falls to 0 while the force of a lost user fades. */
  readonly presence: number;
  /** Latency injected by `set_latency`, each way [s]. */
  readonly latency: Latency;
}

/** The scene at one moment. */
export interface SceneSnapshot {
  /** Time of the snapshot on the server's clock [s]. */
  readonly t_server: number;
  /** Deformed vertices, shape (n, 3) [m]; one array, overwritten by each call of `at`. */
  readonly positions: Float32Array;
  /** Whether `positions` differs from the previous call; otherwise the GPU needs no update. */
  readonly moved: boolean;
  /** Sorted by number. */
  readonly users: readonly UserState[];
  readonly room: RoomLag;
}

/** The room as `watching` described it. */
export interface WatchInfo {
  readonly body: BodyInfo;
  /** Simulation period N T [s]. */
  readonly simulation_period: number;
  /** Content hash of the model; null where the encoding "forces" is not available. */
  readonly model: string | null;
  readonly allow_latency: boolean;
  readonly allow_fixed_gains: boolean;
  /** Whether a page on the server's own machine may bring an object. */
  readonly allow_upload: boolean;
  /** Whether this visitor may touch as well. */
  readonly can_touch: boolean;
  /** Whether this visitor administers the room. */
  readonly room_admin: boolean;
  readonly can_record: boolean;
}

export type Encoding = "frames" | "forces";

export type WatchPhase = "connecting" | "watching" | "waiting" | "refused";

/** Silence after which the scene no longer counts as live [s]; a server sends a sign of life at twice this rate. */
export const NO_WORD = 1;

/** Whether the page shows the present state and not an old one. */
export function isLive(status: Pick<WatchStatus, "phase" | "silent">): boolean {
  return status.phase === "watching" && status.silent < NO_WORD;
}

/** State of the watch connection. */
export interface WatchStatus {
  readonly phase: WatchPhase;
  /** Reason why the phase is not "watching", one sentence; empty for none. */
  readonly reason: string;
  /** Close code of the last connection (docs/protocol.md); 0 while one is open. */
  readonly code: number;
  /** Time of the next attempt while "waiting" [s]. */
  readonly retry_at: number;
  /** Time since the newest message of the server [s]; 0 before the first. */
  readonly silent: number;
  /** Frames and bytes since the connection was opened. */
  readonly frames: number;
  readonly bytes: number;
  /** Rates over the last second. */
  readonly frames_per_second: number;
  readonly bytes_per_second: number;
  /** Delay of the display behind the newest frame, which leaves two frames to interpolate between [s]. */
  readonly playout_delay: number;
  /** Encoding in use: "frames" while blocks of Green's functions are being fetched. */
  readonly encoding: Encoding;
  /** Blocks in the cache, and blocks still missing. */
  readonly blocks: number;
  readonly blocks_missing: number;
}

/** An event in the room, for people. */
export interface RoomEvent {
  readonly at: number;
  readonly kind: "joined" | "left" | "renamed" | "latency" | "restraint" | "error";
  readonly user: number;
  readonly name: string;
  /** The reason, or the values, as text. */
  readonly detail: string;
}

/** Rolling history of one quantity, oldest first. */
export interface Series {
  readonly length: number;
  /** Time of sample i [s]. */
  time(i: number): number;
  value(i: number): number;
}

/** The plotted quantities of one user; times on the server's clock [s]. */
export interface UserHistory {
  /** |force| [N]. */
  readonly force: Series;
  /** Depth below the surface free of the user's own force [m]. */
  readonly depth: Series;
  /** K_o coupled and K_h [N/m]. */
  readonly k_o_coupled: Series;
  readonly k_h: Series;
  readonly loop_delay: Series;
}

/** The page's copy of the scene. Made by `openWatch` (`watch/connection.ts`). */
export interface SceneStore {
  /** The recorded session that the page shows; absent where it shows a room. */
  readonly file?: RecordedSession;
  readonly status: WatchStatus;
  /** The room; null before the first message `watching`. */
  readonly info: WatchInfo | null;
  /** Resting mesh; null before it arrived, a new object when the body has changed. */
  readonly mesh: RestMesh | null;
  /** Events, the newest last; at most 100. */
  readonly events: readonly RoomEvent[];
  readonly restraints: Restraints;
  /** Whether the server records the session. */
  readonly onRecord: boolean;
  /** Names of users who were put out; empty if this visitor is no administrator. */
  readonly putOut: readonly string[];
  /** Messages about the other people here. */
  readonly company: CompanyLink;
  /** All users in the room, also without a contact, sorted by number. */
  readonly roster: readonly { readonly user: number; readonly name: string }[];
  /**
   * The scene interpolated between frames for display at `now`: a pure function of `now` and of the messages so far.
   * Null before mesh and first frame.
   */
  at(now: number): SceneSnapshot | null;
  /** Rolling histories for plots, by user. */
  history(user: number): UserHistory | null;
  /** The last minute as it was received (`watch/frame_ring.ts`); null before a frame of this object has come. */
  recorded(): Recording | null;
  setView(encoding: Encoding, rate: number): void;
  /** Refused by the server unless `info.allow_latency`. */
  setLatency(user: number, wish: LatencyWish): void;
  /** Refused by the server unless `info.room_admin`. An order about a person needs `user`, or `name` for one who was put out. */
  order(order: Order, user?: number, name?: string): void;
  /** Notifies of changes of status, info, mesh, roster or events, but not of frames: call `at` when drawing. */
  readonly subscribe: Subscribe;
  close(): void;
}
