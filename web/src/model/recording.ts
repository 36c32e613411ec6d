/** A copy of what the page received in the last minute, which does not change while the stream goes on. */

import type { BodyInfo, RestMesh } from "./body";
import type { Vec3 } from "./vec";

/** A load on the body as a scene reports it: its place, the outward normal, and the force on the hand [N]. */
export interface ToldLoad {
  readonly foot: Vec3;
  readonly normal: Vec3;
  readonly force: Vec3;
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
