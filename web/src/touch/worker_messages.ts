/** The messages between the page and the haptic Worker. */

import type { HandSettings, TouchSettings, TouchState } from "../model/hand";
import type { FixedGains, LawName } from "../model/laws";
import type { Vec3 } from "../model/vec";

export type ToWorker =
  | {
      readonly type: "start";
      readonly settings: TouchSettings;
      /** Origin of the page's clock, `performance.timeOrigin` [ms], so that page and Worker read the same time. */
      readonly time_origin: number;
    }
  | { readonly type: "point"; readonly target: Vec3; readonly presses: boolean }
  | { readonly type: "law"; readonly law: LawName; readonly fixed: FixedGains | null }
  | { readonly type: "hand"; readonly hand: HandSettings }
  | { readonly type: "name"; readonly name: string }
  | { readonly type: "friction"; readonly mu: number }
  /** Delay to be added to each message from now on, each way [s]. */
  | { readonly type: "delay"; readonly delay: number }
  /** Whether reports explain the force. */
  | { readonly type: "explain"; readonly wanted: boolean }
  /** The page draws; sent now and then, so that the hand of a page that stands still does not press on. */
  | { readonly type: "alive" }
  | { readonly type: "close" };

export type FromWorker =
  | {
      readonly type: "state";
      readonly state: TouchState;
      /** Step of the Worker's clock [s]; 0 or absent where the clock is finer than the timers. */
      readonly clock_step?: number;
    }
  /** The Worker has ended; its last state came before this message. */
  | { readonly type: "ended" };
