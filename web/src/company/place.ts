/** The company on the page: follows a view, lets others follow this one, points. Its code is loaded on demand. */

import { type Aim, type CompanyLink, MARK_LASTS } from "../model/company";
import type { Vec3 } from "../model/vec";
import { keep, recall } from "../ui/theme";
import { FARTHEST, NEAREST, type Orbit, STEEPEST } from "../view/orbit";
import { CompanyBar } from "./bar";
import { Pill, type PillLine } from "./pill";
import type { Surroundings } from "./surroundings";
import { Told } from "./told";
import { followerWords, pointedWords } from "./words";

const OPEN = "cohaptic.open";
const TOLD_FOR = 6; // s for which a refusal is shown
const POINT_EVERY = 1; // s between two presses that point; the server allows one in two seconds, and four at once
const FEEL = 1e-3; // rad, or radii: a view that differs by less is the same

export class CompanyPlace {
  readonly pill = new Pill();
  readonly bar: CompanyBar;
  readonly told: Told;
  /** Whether the next press points. */
  armed = false;
  private open = recall(OPEN) !== "no";
  private shown: CompanyLink["aimed"] = null;
  private sent: Aim | null = null;
  private followers = "";
  private spoken = -Infinity;
  private pointed = -Infinity;
  /** Whether this page has stopped following and the server has not confirmed that yet. */
  private own = false;
  /** Name of the user whom the address asks to follow, once that user is here. */
  private wanted: string | null;

  constructor(private readonly page: Surroundings, search: string) {
    this.told = new Told((user) => page.colour(user));
    this.wanted = new URLSearchParams(search).get("follow");
    this.bar = new CompanyBar(() => { this.armed = !this.armed; }, (open) => {
      this.open = open;
      keep(OPEN, open ? "yes" : "no");
    });
  }

  private get link(): CompanyLink {
    return this.page.store.company;
  }

  /** Number of the own hand; 0 without one. */
  private get user(): number {
    const state = this.page.own.state;
    return state?.phase === "joined" ? state.user : 0;
  }

  /** User whose view this page follows; null for nobody. */
  get following(): number | null {
    return this.own ? null : (this.link.state?.following ?? null);
  }

  /** Follow a user's view; null stops following. */
  follow(user: number | null): void {
    this.own = user === null;
    this.wanted = null;
    this.link.follow(user);
  }

  /** The visitor has turned or zoomed the view, which ends following. */
  moved(): void {
    if (this.following !== null) this.follow(null);
  }

  /** Follow the next user who may be followed, and nobody after the last one. */
  followNext(): void {
    const state = this.link.state;
    const others = (state?.open ?? []).filter((user) => user !== this.user);
    const at = this.following === null ? -1 : others.indexOf(this.following);
    this.follow(others[at + 1] ?? null);
    if (others.length === 0) this.page.speak("There is nobody whose view you could follow.");
  }

  /**
   * Point where a ray meets the object.
   *
   * @returns Whether the ray meets an object at which this visitor may point; a press that was to point is then used up.
   */
  point(origin: Vec3, direction: Vec3, now: number): boolean {
    const place = this.page.own.placeAt(origin, direction);
    if (place === null || this.link.state?.may_point !== true) return false;
    this.armed = false;
    if (now - this.pointed < POINT_EVERY) return true;
    this.pointed = now;
    this.link.point(place);
    return true;
  }

  /** To be called for every picture: moves the view to that of the followed user. */
  frame(): void {
    const { aimed } = this.link;
    const stage = this.page.stage;
    if (aimed === this.shown || stage === null) return;
    this.shown = aimed;
    if (aimed !== null && aimed.user === this.following) stage.goTo(within(aimed));
  }

  /** To be called some times a second: updates the words, and tells others of this visitor and its view. */
  update(now: number): void {
    const link = this.link;
    const { state } = link;
    const { user } = this;
    const name = this.page.visitor.name;
    link.present({ name, user: user > 0 ? user : null, open: user > 0 && this.open, ...(user > 0 ? { key: this.page.settings.key } : {}) });
    if (state?.following === null) this.own = false;
    this.followWanted();
    const followers = followerWords(state?.followers ?? []);
    if (followers !== this.followers) {
      if (followers === "" && state !== null) this.page.speak("Nobody sees what you see any more.");
      this.followers = followers;
      this.sent = null; // a new follower has not got the view yet
    }
    this.tellAim(state?.followers.length ?? 0);
    this.bar.update(state, user > 0, this.open, this.armed);
    for (const mark of link.marks) {
      if (mark.at <= this.spoken || now - mark.at > MARK_LASTS) continue;
      this.page.speak(pointedWords(mark, mark.user !== null && mark.user === user));
    }
    this.spoken = link.marks.at(-1)?.at ?? this.spoken;
    this.pill.set(this.line(now));
    this.told.update(this.page.present, this.page.own.state, this.page.store, now);
  }

  private followWanted(): void {
    if (this.wanted === null) return;
    const state = this.link.state;
    const found = this.page.store.roster.find((one) => one.name === this.wanted);
    if (found !== undefined && state?.open.includes(found.user) === true) this.follow(found.user);
  }

  private tellAim(followers: number): void {
    const stage = this.page.stage;
    if (followers === 0 || stage === null) {
      this.sent = null;
      return;
    }
    const { azimuth, elevation, distance } = stage.target;
    const aim = { azimuth: Math.atan2(Math.sin(azimuth), Math.cos(azimuth)), elevation, distance };
    const { sent } = this;
    if (sent !== null && Math.abs(aim.azimuth - sent.azimuth) + Math.abs(aim.elevation - sent.elevation) + Math.abs(aim.distance - sent.distance) < FEEL) return;
    this.sent = aim;
    this.link.aim(aim);
  }

  private line(now: number): PillLine | null {
    const link = this.link;
    if (this.armed) return { words: "Press where you want to point.", button: "Cancel", press: () => { this.armed = false; } };
    if (link.declined !== null && now - link.declined.at < TOLD_FOR) return { words: link.declined.reason, button: "", press: () => undefined };
    const { following } = this;
    if (following !== null) {
      const name = this.page.store.roster.find((one) => one.user === following)?.name ?? `user ${following}`;
      return { words: `You see what ${name} sees.`, button: "Stop", press: () => { this.follow(null); } };
    }
    if (this.followers === "") return null;
    return { words: this.followers, button: "Keep my view to myself", press: () => { this.open = false; keep(OPEN, "no"); } };
  }
}

/** A view that another page sent, limited to where this page's camera can stand. */
function within({ azimuth, elevation, distance }: Aim): Orbit {
  return { azimuth, elevation: Math.max(-STEEPEST, Math.min(STEEPEST, elevation)), distance: Math.max(NEAREST, Math.min(FARTHEST, distance)) };
}
