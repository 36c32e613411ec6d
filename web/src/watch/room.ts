/** The users and the events of a room. */

import type { Latency, LoopRules, RoomEvent } from "../model/scene";
import { NO_RESTRAINTS, type Restraints } from "../model/orders";
import type { WatchEvent } from "./session";

const MOST_EVENTS = 100;
const MOST_REMEMBERED = 256; // names, also of those who have left
const NONE: Latency = { delay: 0, jitter: 0, network: "" };

/** Roster, injected latency and the newest events of a room. */
export class Room {
  private readonly names = new Map<number, string>();
  private readonly latencies = new Map<number, Latency>();
  private readonly rules = new Map<number, LoopRules>();
  private readonly heard = new Map<number, string>();
  events: readonly RoomEvent[] = [];
  restraints: Restraints = NO_RESTRAINTS;
  onRecord = false;
  /** Names of people who may not come back; the server tells them only to an administrator. */
  putOut: readonly string[] = [];

  get roster(): readonly { readonly user: number; readonly name: string }[] {
    return [...this.names].map(([user, name]) => ({ user, name })).sort((a, b) => a.user - b.user);
  }

  /** Names of all recent users, including those who have left. */
  get everybody(): ReadonlyMap<number, string> {
    return new Map(this.heard);
  }

  nameOf(user: number): string {
    return this.names.get(user) ?? "";
  }

  /** Difference of a user's loop from the rules of this version; null if its client said none. */
  rulesOf(user: number): LoopRules | null {
    return this.rules.get(user) ?? null;
  }

  latencyOf(user: number): Latency {
    return this.latencies.get(user) ?? NONE;
  }

  /** Take an event of the server; scenes and meshes change nothing here. */
  take(event: WatchEvent, at: number): void {
    switch (event.type) {
      case "watching":
        this.names.clear();
        this.latencies.clear();
        this.rules.clear();
        // A room that has restraints sends them next.
        this.restraints = NO_RESTRAINTS;
        this.onRecord = false;
        this.putOut = [];
        for (const { user, name, rules } of event.users) this.call(user, name, rules);
        break;
      case "user_joined": {
        const before = this.names.get(event.user);
        this.call(event.user, event.name, event.rules);
        if (before === undefined) this.say({ at, kind: "joined", user: event.user, name: event.name, detail: "" });
        else this.say({ at, kind: "renamed", user: event.user, name: before, detail: `goes by the name ${event.name} now.` });
        break;
      }
      case "user_left":
        this.names.delete(event.user);
        this.latencies.delete(event.user);
        this.rules.delete(event.user);
        this.say({ at, kind: "left", user: event.user, name: event.name, detail: event.reason });
        break;
      case "latency": {
        const { user, delay, jitter, network } = event;
        this.latencies.set(user, { delay, jitter, network });
        const detail = `${network === "" ? "" : `${network}, `}${Math.round(1e3 * delay)} ms each way, up to ${Math.round(1e3 * jitter)} ms more`;
        this.say({ at, kind: "latency", user, name: this.nameOf(user), detail });
        break;
      }
      case "restraints":
        this.restrain({ frozen: event.frozen, muted: event.muted }, at);
        break;
      case "recorded":
        this.onRecord = event.on;
        this.say({ at, kind: "restraint", user: 0, name: "", detail: event.on ? "The session is recorded." : "Nothing is recorded any more." });
        break;
      case "put_out":
        this.putOut = event.names;
        break;
      case "error":
        this.say({ at, kind: "error", user: 0, name: "", detail: event.message });
        break;
      case "moderated":
      case "company":
      case "aimed":
      case "pointed":
      case "declined":
      case "rest_mesh":
      case "scene":
    }
  }

  private call(user: number, name: string, rules: LoopRules | undefined): void {
    this.names.set(user, name);
    if (rules !== undefined) this.rules.set(user, rules);
    this.heard.delete(user); // the newest last
    this.heard.set(user, name);
    for (const oldest of this.heard.keys()) {
      if (this.heard.size <= MOST_REMEMBERED) break;
      this.heard.delete(oldest);
    }
  }

  private restrain(next: Restraints, at: number): void {
    const before = this.restraints;
    this.restraints = next;
    if (before.frozen !== next.frozen) {
      this.say({ at, kind: "restraint", user: 0, name: "", detail: next.frozen ? "The object is frozen." : "The object takes forces again." });
    }
    for (const user of this.names.keys()) {
      const [was, is] = [before.muted.includes(user), next.muted.includes(user)];
      if (was !== is) this.say({ at, kind: "restraint", user, name: this.nameOf(user), detail: is ? "is muted." : "is not muted any more." });
    }
  }

  private say(event: RoomEvent): void {
    this.events = [...this.events.slice(1 - MOST_EVENTS), event];
  }
}
