/** Who else is here: how many watch, whose view is followed, who points at what. */

import type { Vec3 } from "./vec";

/** From where a page looks, as the wire has it. */
export interface Aim {
  /** Round the vertical, 0 from +x, within half a turn either way [rad]. */
  readonly azimuth: number;
  /** Above the horizon [rad]. */
  readonly elevation: number;
  /** In radii of the body. */
  readonly distance: number;
}

export interface Follower {
  /** Null for one who only watches. */
  readonly user: number | null;
  readonly name: string;
}

/** The room as far as it concerns this page; the server's word. */
export interface Company {
  /** How many watch and have no hand here, this page with them. */
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
  /** Null for one who only watches. */
  readonly user: number | null;
  readonly name: string;
  /** Of the resting surface [m]. */
  readonly point: Vec3;
  /** When it came, on the page's clock [s]. */
  readonly at: number;
}

/** Who sits at this page. */
export interface Presence {
  readonly name: string;
  readonly user: number | null;
  /** Of the hand, so that nobody else can say that it is theirs. */
  readonly key?: string;
  readonly open: boolean;
}

/** How long a mark is seen [s]. */
export const MARK_LASTS = 5;

/** What a page hears and says of its company. */
export interface CompanyLink {
  /** Null while the server has said nothing of it, or does not know it. */
  readonly state: Company | null;
  /** The view of the one who is followed; another object with each message. */
  readonly aimed: (Aim & { readonly user: number }) | null;
  /** Newest last. */
  readonly marks: readonly Mark[];
  /** Why the newest wish came to nothing, and when that was heard [s]. */
  readonly declined: { readonly what: string; readonly reason: string; readonly at: number } | null;
  present(who: Presence): void;
  follow(user: number | null): void;
  aim(aim: Aim): void;
  point(point: Vec3): void;
}
