/** Tells screen readers who came, who left, and which errors occurred. */

import type { RoomEvent } from "../model/scene";

/** Sentence for one event; empty for events that are not worth an interruption. */
export function spoken(event: RoomEvent): string {
  const who = event.name === "" ? `User ${event.user}` : event.name;
  switch (event.kind) {
    case "joined":
      return `${who} has come.`;
    case "left":
      return `${who} has left.`;
    case "renamed":
      return `${who} ${event.detail}`;
    case "error":
      return event.detail;
    case "restraint":
      return event.user === 0 ? event.detail : `${who} ${event.detail}`;
    case "latency":
      return "";
  }
}

export class Announcer {
  private readonly node: HTMLElement;
  private newest = -Infinity;

  constructor(node: HTMLElement) {
    this.node = node;
  }

  /** Announce words that are not about an event of the server. */
  say(words: string): void {
    this.node.textContent = words;
  }

  news(events: readonly RoomEvent[]): void {
    const fresh = events.filter((event) => event.at > this.newest);
    const last = fresh.at(-1);
    if (last === undefined) return;
    this.newest = last.at;
    const words = fresh.map(spoken).filter((text) => text !== "");
    if (words.length > 0) this.node.textContent = words.slice(-3).join(" ");
  }
}
