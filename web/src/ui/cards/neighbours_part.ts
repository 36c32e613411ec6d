/** The part on the campaign's rooms that resemble this one, beside the stable gains; loaded when it is first shown. */

import type { RoomFacts } from "../../control/neighbours";
import type { RoomLag } from "../../model/body";
import type { UserState } from "../../model/scene";
import { el, say, show } from "../dom";
import { COMMAND, ENSEMBLE, MOST_HANDS, neighbourWords, roomFacts, sameRoom } from "./neighbour_words";

export class NeighboursPart {
  readonly root: HTMLElement;
  private readonly words = el("p", { class: "fine neighbours-words" });
  private facts: RoomFacts | null = null;

  constructor() {
    this.root = el(
      "div",
      { class: "neighbours" },
      el("h4", { class: "neighbours-title", text: "Rooms like this one, simulated" }),
      this.words,
      el("details", { class: "neighbours-how" }, el("summary", { text: "What was simulated" }), el("p", { class: "fine", text: ENSEMBLE }), el("p", { class: "fine" }, "Made by ", el("code", { text: COMMAND }))),
    );
    show(this.root, false);
  }

  update(users: readonly UserState[], room: RoomLag | null): void {
    const facts = room === null ? null : roomFacts(users, room, MOST_HANDS);
    show(this.root, facts !== null);
    const known = facts === null || typeof facts === "string" ? null : facts;
    if (known !== null && this.facts !== null && sameRoom(this.facts, known)) return;
    this.facts = known;
    if (facts !== null) say(this.words, neighbourWords(facts));
  }
}
