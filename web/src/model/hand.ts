/** The hand of the visitor, between the page and its haptic Worker. */

import type { FixedGains, LawName } from "./laws";
import type { EntryName, RuleName } from "./rules";
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
  /** Secret of the page, with which it gets its name back after a lost connection. */
  readonly key?: string;
  /** Token of an invitation or a session; undefined where none is needed. */
  readonly token?: string;
  /** Whether to wait for a seat if the room is full. */
  readonly wait?: boolean;
}

export type TouchPhase = "connecting" | "joined" | "closed";

/** What each rule of the loop did to the size of the force in one period [N]; together they are the force. */
export type Ledger = Readonly<Record<EntryName, number>>;

/** A force explained. */
export interface Explained {
  /** Rules of the Python client's loop that the page's lacks, in their order. */
  readonly lacking: readonly RuleName[];
  /** Ledger of the newest period; null before the first. */
  readonly ledger: Ledger | null;
}

/** Report of the haptic Worker, about 60 times a second. */
export interface TouchState {
  readonly phase: TouchPhase;
  /** Reason why the connection is closed or tried again, one sentence; empty otherwise. */
  readonly reason: string;
  /** Close code that belongs to the reason; 0 for none. */
  readonly code: number;
  /** Place in the queue before a full room, from 1, and the number of places; null for a hand that does not wait. */
  readonly place: readonly [number, number] | null;
  /** State of the loop: "connecting", "waiting" (to be engaged), "free", "touching", "server silent" or "stopped". */
  readonly doing: string;
  /** Number and name in the room; 0 before the welcome. */
  readonly user: number;
  readonly name: string;
  /** Reason why the hand did not get the name that was asked for last; empty for none. */
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
  /** The law in use, and the requested one: they differ during a change. */
  readonly law: LawName | null;
  readonly requested_law: LawName;
  readonly k_o: number;
  readonly k_h: number;
  /** Share of the requested force that the safety layer gives, 0 to 1. */
  readonly scale: number;
  /** Reason why the force is off; empty for none. */
  readonly fault: string;
  /** Round trip of the link [s]; 0 before the first patch. */
  readonly round_trip: number;
  /** Shortest recent round trip, which is that of the network [s]; null before the first patch. */
  readonly network: number | null;
  /** Server's clock minus the page's [s]. */
  readonly clock_offset: number;
  /** Time by which others are felt later than the link's least delay, so that its jitter is not felt [s]. */
  readonly wavers: number;
  readonly simulation_period: number;
  /** Since the last report: most by which a tick of the server was late, and a period of the loop [s]. */
  readonly tick_late: number;
  readonly loop_stall: number;
  /** Periods since the last report, 4 numbers for each: t [s], |force| [N], depth [m], force from others [N]. */
  readonly trace: Float64Array;
  /** Why the force is as it is; null while nobody asks, `TouchHandle.explain`. */
  readonly explained: Explained | null;
}

/** Measurements of the page on its own hand's connection, besides the server's measurement of the whole loop. */
export interface OwnLink {
  /** The network's round trip [s]; null before it is measured. */
  readonly network: number | null;
  /** Longest recent wait of a message for the page, for instance while the page drew [s]. */
  readonly page_wait: number;
  /** Step of the clock that the browser gives the hand [s]; 0 where it is finer than needed. */
  readonly clock_step: number;
  /** Most of late by which a tick of the server was late, and a period of the hand's loop [s]. */
  readonly tick_late: number;
  readonly loop_stall: number;
  /** `wavers` of the hand's state [s]. */
  readonly wavers: number;
}

/** A hand in the room. Made by `startTouch` (`touch/handle.ts`). */
export interface TouchHandle {
  /** Newest report; null before the first. */
  readonly state: TouchState | null;
  /** Reason why the Worker itself has failed and sends no more reports; empty otherwise. */
  readonly failure: string;
  readonly link: OwnLink;
  /**
   * Move the intended hand position [m].
   *
   * @param presses Whether the hand presses, which is the default; a hand that does not press gives way.
   */
  point(target: Vec3, presses?: boolean): void;
  /** To be called with each picture: the hand gives way if the page has not drawn for five seconds. */
  alive(): void;
  /** @param fixed Gains instead of the server's choice; refused unless `WatchInfo.allow_fixed_gains`. */
  setLaw(law: LawName, fixed?: FixedGains | null): void;
  setHand(hand: HandSettings): void;
  /** Change the name without leaving the room; if that is refused, the state says why. */
  setName(name: string): void;
  /** Set mu. If mu becomes zero or no longer is zero, the hand joins the room anew, because the hello announces friction. */
  setFriction(mu: number): void;
  /** Delay each message, each way, by this time beyond the network's [s]; at most 1. */
  setDelay(seconds: number): void;
  /** Whether reports explain the force. */
  explain(wanted: boolean): void;
  /** Notifies of each report. */
  readonly subscribe: Subscribe;
  /** Fade the force and leave the room; resolves when the Worker has ended. */
  close(): Promise<void>;
}
