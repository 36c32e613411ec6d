/** The other people here: how many watch, whose view is followed, and who points at what. */

import type { Vec3 } from "./vec";

/** Position from which a page looks, as the protocol sends it. */
export interface Aim {
  /** Angle around the vertical, 0 from +x, within half a turn either way [rad]. */
  readonly azimuth: number;
  /** Angle above the horizon [rad]. */
  readonly elevation: number;
  /** Distance from the body's middle, in radii of the body. */
  readonly distance: number;
}

export interface Follower {
  /** Number of the user; null for a person who only watches. */
  readonly user: number | null;
  readonly name: string;
}

/** Company in the room as the server reports it to this page. */
export interface Company {
  /** Number of people who watch and have no hand here, including this page. */
  readonly watching: number;
  /** Users whose view may be followed. */
  readonly open: readonly number[];
  /** The user whose view this page is sent. */
  readonly following: number | null;
  readonly followers: readonly Follower[];
  readonly may_point: boolean;
}

/** A place at which somebody points. */
export interface Mark {
  /** Number of the user; null for a person who only watches. */
  readonly user: number | null;
  readonly name: string;
  /** Point of the resting surface [m]. */
  readonly point: Vec3;
  /** Time at which the mark came, on the page's clock [s]. */
  readonly at: number;
}

/** The visitor at this page. */
export interface Presence {
  readonly name: string;
  readonly user: number | null;
  /** Secret of the hand, so that no other page can claim it. */
  readonly key?: string;
  readonly open: boolean;
}

/** Time for which a mark is shown [s]. */
export const MARK_LASTS = 5;

/** Messages between a page and the server about the company. */
export interface CompanyLink {
  /** Null while the server has not reported company, or does not support it. */
  readonly state: Company | null;
  /** View of the user whom this page follows; another object with each message. */
  readonly aimed: (Aim & { readonly user: number }) | null;
  /** Marks, the newest last. */
  readonly marks: readonly Mark[];
  /** The last wish that the server declined, the reason, and when the refusal came [s]. */
  readonly declined: { readonly what: string; readonly reason: string; readonly at: number } | null;
  present(who: Presence): void;
  follow(user: number | null): void;
  aim(aim: Aim): void;
  point(point: Vec3): void;
}
