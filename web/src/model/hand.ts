/** The hand of the visitor, between the page and its haptic Worker. */

import type { FixedGains, LawName } from "./laws";
import type { Subscribe } from "./subscribe";
import type { Vec3 } from "./vec";

/** Mechanics of the simulated hand that follows the cursor. */
export interface HandSettings {
  /** Mass of hand and device together [kg]. */
  readonly mass: number;
  /** Damping of the hand [N s/m]. */
  readonly damping: number;
  /** Stiffness of the spring between cursor and tip [N/m]. */
  readonly stiffness: number;
}

/** Settings of a hand when it joins. */
export interface TouchSettings {
  /** Address of the server, ws: or wss:. */
  readonly url: string;
  /** 1 to 32 printable characters. */
  readonly name: string;
  readonly law: LawName;
  readonly geometry: "plane" | "sphere";
  /** Limit of the force on the hand [N]. */
  readonly max_force: number;
  /** Coefficient of friction mu between finger and surface; 0 for none. */
  readonly friction: number;
  readonly passivity: boolean;
  readonly hand: HandSettings;
  /** Initial position of the cursor, outside the body [m]. */
  readonly target: Vec3;
  /** The page's secret, with which it comes back to its name after a lost connection. */
  readonly key?: string;
  /** Of an invitation or a session; without one where none is needed. */
  readonly token?: string;
  /** Whether to wait for a seat where the room is full. */
  readonly wait?: boolean;
}

export type TouchPhase = "connecting" | "joined" | "closed";

/** Report of the haptic Worker, about 60 times a second. */
export interface TouchState {
  readonly phase: TouchPhase;
  /** Why it is "closed" or trying again, one sentence; empty otherwise. */
  readonly reason: string;
  /** Close code that belongs to the reason; 0 for none. */
  readonly code: number;
  /** Place in the queue before a full room, from 1, and the number of places; null for who does not wait. */
  readonly place: readonly [number, number] | null;
  /** State of the loop: "connecting", "waiting" (to be engaged), "free", "touching", "server silent" or "stopped". */
  readonly doing: string;
  /** Number and name in the room; 0 before the welcome. */
  readonly user: number;
  readonly name: string;
  /** Why it does not go by the name that was asked for last; empty for no reason. */
  readonly name_refused: string;
  /** Time of the report on the page's clock [s]. */
  readonly t: number;
  /** Cursor: the target position of the hand [m]. */
  readonly target: Vec3;
  /** Tip of the device, which yields to the force [m]. */
  readonly probe: Vec3;
  /** Contact point on the surface deformed by the own force too, where the tip is drawn [m]. */
  readonly proxy: Vec3;
  readonly normal: Vec3;
  /** Force on the hand [N]. */
  readonly force: Vec3;
  /** Tangential part of the force, from friction [N]. */
  readonly along: number;
  /** Part of the force that the contacts of the others cause, along the normal [N]. */
  readonly felt_from_others: number;
  /** Depth of the tip below the surface free of its own force; negative outside [m]. */
  readonly depth: number;
  /** Indentation of the surface under the tip by the own force [m]. */
  readonly indentation: number;
  /** Displacement of the contact by the others, along the normal [m]. */
  readonly u_others: number;
  /** The law in use, and the requested one: they differ during a change. */
  readonly law: LawName | null;
  readonly requested_law: LawName;
  readonly k_o: number;
  readonly k_h: number;
  readonly integral_gain: number;
  /** Damping of the passivity layer [N s/m], and the energy that it still has to dissipate [J]. */
  readonly damping: number;
  readonly owed: number;
  /** Share of the requested force that the safety layer gives, 0 to 1. */
  readonly scale: number;
  /** Why the force is off; empty for no reason. */
  readonly fault: string;
  /** Round trip and jitter of the link [s]; 0 before the first patch. */
  readonly round_trip: number;
  readonly jitter: number;
  /** The shortest round trip of late, which is the network's [s]; null before the first patch. */
  readonly network: number | null;
  /** Server's clock minus the page's [s]. */
  readonly clock_offset: number;
  readonly simulation_period: number;
  /** Haptic periods per second, and those lost because the Worker was held up. */
  readonly loop_hz: number;
  readonly missed: number;
  /** Since the report before: t [s], |force| [N], depth [m], force from others [N], 4 numbers for each period. */
  readonly trace: Float64Array;
}

/** What a page knows of the connection of its own hand, apart from what the server measures of all of it. */
export interface OwnLink {
  /** The network's round trip [s]; null before it is measured. */
  readonly network: number | null;
  /** How long a message has waited for the page at most of late, while it drew for instance [s]. */
  readonly page_wait: number;
  /** Steps in which the clock goes that the browser gives the hand [s]; 0 where they are finer than any use of it. */
  readonly clock_step: number;
}

/** A hand in the room. Made by `startTouch` (`touch/handle.ts`). */
export interface TouchHandle {
  /** Newest report; null before the first. */
  readonly state: TouchState | null;
  /** Why there are no more reports, if the Worker itself has failed; empty otherwise. */
  readonly failure: string;
  readonly link: OwnLink;
  /**
   * Move the intended hand position [m].
   *
   * @param presses Whether it is there to be touched, which it is unless said otherwise: one that is not gives way.
   */
  point(target: Vec3, presses?: boolean): void;
  /** The page draws. To be said with each picture: a hand of which nobody was told so for five seconds gives way. */
  alive(): void;
  /** @param fixed Gains instead of the server's choice; refused unless `WatchInfo.allow_fixed_gains`. */
  setLaw(law: LawName, fixed?: FixedGains | null): void;
  setHand(hand: HandSettings): void;
  /** Go by another name, without leaving; where it cannot be had, the state says why. */
  setName(name: string): void;
  /** Set mu. Between zero and above zero the hand leaves the room for a moment, since the hello announces friction. */
  setFriction(mu: number): void;
  /** Have each message take longer, each way [s]: at most 1, 0 for no longer than the network does. */
  setDelay(seconds: number): void;
  /** Notifies of each report. */
  readonly subscribe: Subscribe;
  /** Fade the force and leave the room; resolves when the Worker has ended. */
  close(): Promise<void>;
}
