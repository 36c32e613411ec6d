/**
 * What the parts of the page say to each other.
 *
 * Names of quantities are those of the wire and of `docs/notation.md`; SI everywhere, mm and ms only on screen.
 * Times are in seconds on the page's clock, `performance.now() / 1000`, unless a name says otherwise; `now` is an
 * argument. Text that came from others (names, reasons) is text, never markup.
 */

export type Vec3 = readonly [number, number, number];

/** Symmetric, of a contact in all directions, world frame: xx, yy, zz, xy, xz, yz [m/N]. */
export type Compliance3 = readonly [number, number, number, number, number, number];

export type LawName = "proportional" | "pi" | "predictive";
export type GeometryName = "plane" | "sphere" | "mesh";
export type Encoding = "frames" | "forces";

/** Says that something has changed; the answer ends the subscription. */
export type Subscribe = (listener: () => void) => () => void;

/** The body, as in `welcome` and `watching`. */
export interface BodyInfo {
  readonly name: string;
  /** Of the resting surface, world frame [m]. */
  readonly center: Vec3;
  /** Of the sphere round `center` that holds the resting surface [m]. */
  readonly radius: number;
  /** Of the pressure under a contact [m]. */
  readonly contact_radius: number;
}

/** How soon the object answers what the others do (science 3.8). */
export interface RoomLag {
  /** tau in use, 0 for none [s]. */
  readonly lag: number;
  /** m, the spectral radius of the coupling; below 1 no delay can make hands at rest swing. */
  readonly coupling: number;
  /** How far the room is from the edge of stability: above 1 it is stable. */
  readonly margin: number;
}

/** The resting surface: n vertices, m faces. */
export interface RestMesh {
  /** World frame, shape (n, 3) [m]. */
  readonly vertices: Float32Array;
  /** Counter-clockwise seen from outside, shape (m, 3). */
  readonly faces: Uint32Array;
}

/** One user, as the server's world has it at the time shown. */
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
  /** Outward unit normal there. */
  readonly normal: Vec3;
  /** On the hand, world frame; the body carries its opposite [N]. */
  readonly force: Vec3;
  /** Compliance of the contact [m/N]; 0 for one who has left, as the next four. */
  readonly c_ii: number;
  /** Coupling-aware stiffness, which the gains of the paper's laws respect [N/m]. */
  readonly k_o_coupled: number;
  /** Gains that the server chose [N/m], [N/(m s)]. */
  readonly k_h: number;
  readonly integral_gain: number;
  /** Measured, of the whole loop [s]. */
  readonly loop_delay: number;
  /** Of the patch [1/m]. */
  readonly curvature: number;
  readonly law: LawName;
  readonly geometry: GeometryName;
  /** Whether its samples still come. */
  readonly fresh: boolean;
  /** Whether its force may have a part along the surface. */
  readonly friction: boolean;
  /** 1 while there, to 0 as a lost user lets go. */
  readonly presence: number;
  /** Injected by `set_latency`, each way [s]. */
  readonly latency: Latency;
}

/** Injected latency, each way [s]. */
export interface Latency {
  readonly delay: number;
  readonly jitter: number;
}

/** The scene at one moment. */
export interface SceneView {
  /** Server's clock [s]. */
  readonly t_server: number;
  /** Vertices as they are, shape (n, 3) [m]; one array, written again at each call of `at`. */
  readonly positions: Float32Array;
  /** Whether `positions` differs from the call before: else nothing needs to go to the GPU. */
  readonly moved: boolean;
  /** Rising by number. */
  readonly users: readonly UserState[];
  readonly room: RoomLag;
}

/** What the server said of the room in `watching`. */
export interface WatchInfo {
  readonly body: BodyInfo;
  /** N T [s]. */
  readonly simulation_period: number;
  /** Content hash of the model; null where "forces" cannot work. */
  readonly model: string | null;
  readonly allow_latency: boolean;
  readonly allow_fixed_gains: boolean;
}

export type WatchPhase = "connecting" | "watching" | "waiting" | "refused";

/** What the watch connection can say of itself. */
export interface WatchStatus {
  readonly phase: WatchPhase;
  /** Why it is not "watching", one sentence; empty when there is nothing to say. */
  readonly reason: string;
  /** Close code of what ended the last connection (docs/protocol.md); 0 while one is had. */
  readonly code: number;
  /** Next attempt, when "waiting" [s]. */
  readonly retry_at: number;
  /** Since the connection was opened. */
  readonly frames: number;
  readonly bytes: number;
  /** Over the last second or so. */
  readonly frames_per_second: number;
  readonly bytes_per_second: number;
  /** How late frames are shown, so that there are two to interpolate between [s]. */
  readonly playout_delay: number;
  /** In use: "frames" while blocks of Green's functions are on their way. */
  readonly encoding: Encoding;
  /** Blocks that are here, and that are on their way. */
  readonly blocks: number;
  readonly blocks_wanted: number;
}

/** Something that happened in the room, for people. */
export interface RoomEvent {
  readonly at: number;
  readonly kind: "joined" | "left" | "latency" | "error";
  readonly user: number;
  readonly name: string;
  /** Reason, or the values; text. */
  readonly detail: string;
}

/** The page's copy of the scene. Made by `openWatch` (`watch/connection.ts`). */
export interface SceneStore {
  readonly status: WatchStatus;
  /** Null before the first `watching`. */
  readonly info: WatchInfo | null;
  /** Null before it came. A new object when the body has changed. */
  readonly mesh: RestMesh | null;
  /** Newest last, at most 100. */
  readonly events: readonly RoomEvent[];
  /** Who is in the room, also without a contact, rising by number. */
  readonly roster: readonly { readonly user: number; readonly name: string }[];
  /**
   * Interpolated between frames for display at `now`; a pure function of `now` and of what came. Null before mesh
   * and first frame.
   */
  at(now: number): SceneView | null;
  /** Rolling histories for plots, by user. */
  history(user: number): UserHistory | null;
  setView(encoding: Encoding, rate: number): void;
  /** Refused by the server unless `info.allow_latency`. */
  setLatency(user: number, latency: Latency): void;
  /** Status, info, mesh, roster or events changed. Frames do not count: ask `at` when you draw. */
  readonly subscribe: Subscribe;
  close(): void;
}

/** Rolling history of one quantity, oldest first. */
export interface Series {
  readonly length: number;
  /** Time of sample i [s]. */
  time(i: number): number;
  value(i: number): number;
}

/** What is plotted of each user; on the server's clock [s]. */
export interface UserHistory {
  /** |force| [N]. */
  readonly force: Series;
  /** Below the surface free of its own force [m]. */
  readonly depth: Series;
  /** K_o coupled and K_h [N/m]. */
  readonly k_o_coupled: Series;
  readonly k_h: Series;
  readonly loop_delay: Series;
}

/** Gains that a client asks for instead of the server's choice: experiments only. */
export interface FixedGains {
  /** [N/m] */
  readonly k_h: number;
  /** [N/(m s)] */
  readonly integral_gain: number;
}

/** Mechanics of the simulated hand that follows the cursor. */
export interface HandSettings {
  /** Hand and device together [kg]. */
  readonly mass: number;
  /** [N s/m] */
  readonly damping: number;
  /** Of the spring between cursor and tip [N/m]. */
  readonly stiffness: number;
}

export interface TouchSettings {
  /** Of the server, ws: or wss:. */
  readonly url: string;
  /** 1 to 32 printable characters. */
  readonly name: string;
  readonly law: LawName;
  readonly geometry: "plane" | "sphere";
  /** Never more on the hand [N]. */
  readonly max_force: number;
  /** mu between finger and surface; 0 for none. */
  readonly friction: number;
  readonly passivity: boolean;
  readonly hand: HandSettings;
  /** Where the cursor is at first: outside the body [m]. */
  readonly target: Vec3;
}

export type TouchPhase = "connecting" | "joined" | "closed";

/** What the haptic Worker reports, about 60 times a second. */
export interface TouchState {
  readonly phase: TouchPhase;
  /** Why it is "closed" or trying again, one sentence; empty otherwise. */
  readonly reason: string;
  /** Close code behind that reason; 0 for none. */
  readonly code: number;
  /** In words: "connecting", "waiting" (to be engaged), "free", "touching", "server silent", "stopped". */
  readonly doing: string;
  /** Number and name in the room; 0 before the welcome. */
  readonly user: number;
  readonly name: string;
  /** On the page's clock [s]. */
  readonly t: number;
  /** Cursor: where the hand wants to be [m]. */
  readonly target: Vec3;
  /** Tip, which gives way to the force [m]. */
  readonly probe: Vec3;
  /** Tip held on the surface as it is with the own force: where the cursor is drawn [m]. */
  readonly proxy: Vec3;
  readonly normal: Vec3;
  /** On the hand [N]. */
  readonly force: Vec3;
  /** Its part along the surface, of friction [N]. */
  readonly along: number;
  /** Share that is there because others touch too, along the normal [N]. */
  readonly felt_from_others: number;
  /** Of the tip below the surface free of its own force; negative outside [m]. */
  readonly depth: number;
  /** Of the surface under the tip by the own force [m]. */
  readonly indentation: number;
  /** Displacement of the contact by the others, along the normal [m]. */
  readonly u_others: number;
  /** The law in use, and the one asked for: they differ during a change. */
  readonly law: LawName | null;
  readonly law_wanted: LawName;
  readonly k_o: number;
  readonly k_h: number;
  readonly integral_gain: number;
  /** Passivity layer [N s/m], [J]. */
  readonly damping: number;
  readonly owed: number;
  /** Share of the wanted force that the safety layer gives, 0 to 1. */
  readonly scale: number;
  /** Why the force is off; empty for no reason. */
  readonly fault: string;
  /** Of the link [s]; 0 before the first patch. */
  readonly round_trip: number;
  readonly jitter: number;
  /** Server's clock less the page's [s]. */
  readonly clock_offset: number;
  readonly simulation_period: number;
  /** Haptic periods per second, and those lost because the Worker was held up. */
  readonly loop_hz: number;
  readonly missed: number;
  /** Since the report before: t [s], |force| [N], depth [m], force from others [N], 4 numbers for each period. */
  readonly trace: Float64Array;
}

/** A hand in the room. Made by `startTouch` (`touch/handle.ts`). */
export interface TouchHandle {
  /** Newest report; null before the first. */
  readonly state: TouchState | null;
  /** Why there are no more reports, if the Worker itself has failed; empty else. */
  readonly failure: string;
  /** Move the intended hand position [m]. */
  point(target: Vec3): void;
  /** @param fixed Gains instead of the server's choice; refused unless `WatchInfo.allow_fixed_gains`. */
  setLaw(law: LawName, fixed?: FixedGains | null): void;
  setHand(hand: HandSettings): void;
  /** mu from now on; from none to some and back the hand leaves the room for a moment, since the hello tells of it. */
  setFriction(mu: number): void;
  /** A report came. */
  readonly subscribe: Subscribe;
  /** Fade the force, say goodbye; done when the Worker has ended. */
  close(): Promise<void>;
}
