/** The messages between the page and the haptic Worker. */

import type { HandSettings, TouchSettings, TouchState } from "../model/hand";
import type { FixedGains, LawName } from "../model/laws";
import type { Vec3 } from "../model/vec";

export type ToWorker =
  | {
      readonly type: "start";
      readonly settings: TouchSettings;
      /** Of the page's clock, `performance.timeOrigin` [ms]: both then read the same time. */
      readonly time_origin: number;
    }
  | { readonly type: "point"; readonly target: Vec3; readonly presses: boolean }
  | { readonly type: "law"; readonly law: LawName; readonly fixed: FixedGains | null }
  | { readonly type: "hand"; readonly hand: HandSettings }
  | { readonly type: "name"; readonly name: string }
  | { readonly type: "friction"; readonly mu: number }
  /** Each message from now on takes longer, each way [s]. */
  | { readonly type: "delay"; readonly delay: number }
  /** The page draws: said now and then, so that a hand whose page stands still does not press on. */
  | { readonly type: "alive" }
  | { readonly type: "close" };

export type FromWorker =
  | {
      readonly type: "state";
      readonly state: TouchState;
      /** Steps in which the Worker's clock goes [s]; 0, or not said, where it is finer than its timers. */
      readonly clock_step?: number;
    }
  /** The Worker has nothing more to say; the last state came before. */
  | { readonly type: "ended" };
