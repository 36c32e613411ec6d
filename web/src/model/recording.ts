/** A copy of what the page received in the last minute, which does not change while the stream goes on. */

import type { BodyInfo, RestMesh } from "./body";
import type { Vec3 } from "./vec";

/** A load on the body as a scene reports it: its place, the outward normal, and the force on the hand [N]. */
export interface ToldLoad {
  readonly foot: Vec3;
  readonly normal: Vec3;
  readonly force: Vec3;
}

/** A moment of a recorded session to which people want to jump. */
export interface Moment {
  /** Time on the server's clock [s]. */
  readonly t: number;
  readonly kind: "joined" | "left" | "mark" | "event" | "damage";
  /** Number of the user whom it concerns; null for nobody. */
  readonly user: number | null;
  readonly text: string;
}

/** A recorded session in a file, of which a page holds some seconds. Times are on the server's clock [s]. */
export interface RecordedSession {
  /** Name of the file. */
  readonly name: string;
  readonly first: number;
  readonly last: number;
  /** Time at which its replay begins. */
  readonly start: number;
  /** Joins, leaves, marks and events, by rising time. */
  readonly moments: readonly Moment[];
  /** Time to which a part of the page wants to go; the replay takes it with its next picture. */
  wanted: number | null;
  /** Whether the scenes at a time are there. */
  has(t: number): boolean;
  /** Why no scenes come, in words; empty for no reason. */
  readonly trouble: string;
  /**
   * The part round a time, which may not have come yet; what is needed next is fetched.
   *
   * @param speed Seconds of the session in a second.
   */
  round(t: number, speed: number): Recording;
}

export interface Recording {
  readonly mesh: RestMesh;
  readonly info: { readonly body: BodyInfo };
  /** Times of the frames, on the server's clock [s], rising; never empty. */
  readonly times: Float64Array;
  /** The frames as they came (docs/protocol.md, scene). */
  readonly frames: readonly Uint8Array[];
  /** Names of all users whom the page has heard of, also of those who have left. */
  readonly names: ReadonlyMap<number, string>;
  /** Time between two frames of a stream without a pause [s]. */
  readonly interval: number;
  /**
   * Displacement of all vertices by loads, shape (n, 3) [m]; null while Green's functions for it are on their way. Null itself where the body
   * is no sum of Green's functions.
   */
  readonly surface: ((loads: readonly ToldLoad[]) => Float32Array | null) | null;
}
