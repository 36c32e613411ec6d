/** The messages about company that this page receives and sends, over all connections to a room. Without I/O. */

import type { Aim, Company, CompanyLink, Mark, Presence } from "../model/company";
import type { Vec3 } from "../model/vec";
import type { ClientControl } from "../protocol/messages";
import type { WatchEvent } from "./session";

const MOST_MARKS = 16;

export class CompanyTalk implements CompanyLink {
  state: Company | null = null;
  aimed: CompanyLink["aimed"] = null;
  marks: readonly Mark[] = [];
  declined: CompanyLink["declined"] = null;
  private presence: Presence | null = null;
  /** User whom the page followed when the connection was lost; the page follows that user again on the next connection. */
  private lost: number | null = null;

  /** @param say Sends a message, if there is a connection. */
  constructor(private readonly say: (message: ClientControl) => void) {}

  /** Take an event of the server; events that are not about company change nothing. */
  take(event: WatchEvent, at: number): void {
    switch (event.type) {
      case "watching":
        // This is another connection, so the state of the former one no longer holds.
        this.lost = this.state?.following ?? this.lost;
        [this.state, this.aimed] = [null, null];
        break;
      case "company": {
        const first = this.state === null;
        this.state = event;
        if (event.following === null) this.aimed = null;
        if (first && this.presence !== null) this.say({ type: "present", ...this.presence });
        if (first && this.lost !== null) this.follow(this.lost);
        break;
      }
      case "aimed":
        this.aimed = event;
        break;
      case "pointed": {
        const { user, name, point } = event;
        this.marks = [...this.marks.slice(1 - MOST_MARKS), { user, name, point, at }];
        break;
      }
      case "declined":
        this.declined = { what: event.what, reason: event.reason, at };
        break;
      default:
    }
  }

  present(who: Presence): void {
    const before = this.presence;
    this.presence = who;
    const same = before !== null && before.name === who.name && before.user === who.user && before.open === who.open && before.key === who.key;
    if (!same && this.state !== null) this.say({ type: "present", ...who });
  }

  follow(user: number | null): void {
    this.lost = null;
    if (this.state !== null) this.say({ type: "follow", user });
  }

  aim({ azimuth, elevation, distance }: Aim): void {
    if (this.state !== null) this.say({ type: "aim", azimuth, elevation, distance });
  }

  point(point: Vec3): void {
    if (this.state !== null) this.say({ type: "point", point });
  }
}
