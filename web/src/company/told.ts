/** Lines over the stage on what others do: who came, who left, who presses, and whom the visitor feels. */

import type { TouchState } from "../model/hand";
import type { RoomEvent, SceneSnapshot, SceneStore } from "../model/scene";
import { answersOwnDent } from "../model/laws";
import { norm } from "../model/vec";
import { el, say, show } from "../ui/dom";
import { fixed, named } from "../ui/words";
import { LEAST_FORCE } from "../view/pose";

const LASTS = 5; // s for which news are shown
const LEAST_FELT = 0.05; // N, what a fingertip just tells apart from nothing
/** An ended press still counts for AFTER [s] and LAGS times the lag of the room: its force leaves the object so slowly. */
const [AFTER, LAGS] = [0.3, 3];
const LONGEST = 32; // letters of two names in one line: more would hide the object on a phone

export interface Person {
  readonly user: number;
  readonly name: string;
}

const called = ({ user, name }: Person): string => (name === "" ? `User ${user}` : named(name));

/** The other users whose force acts on the object now. */
export function pressing(view: Pick<SceneSnapshot, "users">, own: number, { frozen, muted }: SceneStore["restraints"]): Person[] {
  return view.users.filter(({ user, c_ii, force }) => !frozen && user !== own && c_ii > 0 && norm(force) > LEAST_FORCE && !muted.includes(user));
}

/** Words on what one or two users do, by name; users of long names, and more than two users, are "Others". */
function together(who: readonly Person[], one: string, several: string): string {
  const [first, second, ...more] = who.map(called);
  if (first === undefined) return "";
  if (second === undefined) return `${first} ${one}`;
  return `${more.length === 0 && first.length + second.length <= LONGEST ? `${first} and ${second}` : "Others"} ${several}`;
}

export const pressWords = (who: readonly Person[]): string => together(who, "presses.", "press.");

/**
 * Words on what a hand feels from others; empty if no user is known to cause it.
 *
 * @param felt Part of the hand's force that others cause; negative where they draw the surface away [N].
 * @param who Users who press, or pressed a moment ago.
 */
export function pushWords(felt: number, who: readonly Person[]): string {
  if (who.length === 0 || Math.abs(felt) < LEAST_FELT) return "";
  const newtons = `${fixed(Math.abs(felt), 1)} N`;
  return felt > 0 ? `${together(who, "pushes", "push")} you: ${newtons}` : `${together(who, "draws", "draw")} the surface away from you: ${newtons} less`;
}

const newsWords = (event: RoomEvent): string => `${called(event)} has ${event.kind === "joined" ? "come" : "left"}.`;

export class Told {
  private readonly push = el("p", { class: "told-push" });
  private readonly news = el("p", { class: "told-news" });
  readonly root = el("div", { class: "told" }, this.push, this.news);
  /** The visitor's own hands, also those that have left, with their newest names. */
  private readonly mine = new Map<number, string>();
  /** Other users who press or pressed lately, with the time when they were last seen to press. */
  private readonly pressed = new Map<number, Person & { readonly at: number }>();

  constructor(private readonly colour: (user: number) => string) {}

  /**
   * To be called some times a second.
   *
   * @param view The present scene; null where it is not known what others do.
   */
  update(view: SceneSnapshot | null, own: TouchState | null, { events, restraints }: Pick<SceneStore, "events" | "restraints">, now: number): void {
    if (own !== null && own.user > 0) this.mine.set(own.user, own.name);
    const joining = own?.user === 0 && own.place === null; // the next user who joins may be the visitor
    const event = events.findLast(({ kind, at, user, name }) => (kind === "joined" || kind === "left") && now - at < LASTS && !joining && this.mine.get(user) !== name);
    for (const { user, name } of view === null ? [] : pressing(view, own?.user ?? 0, restraints)) {
      if (this.mine.get(user) !== name) this.pressed.set(user, { user, name, at: now });
    }
    for (const [user, { at }] of this.pressed) {
      if (view === null || now - at > AFTER + LAGS * view.room.lag) this.pressed.delete(user);
    }
    const who = [...this.pressed.values()].sort((a, b) => a.user - b.user);
    // Under the paper's laws the force from others also contains the own dent, which comes back late.
    const told = own?.doing === "touching" && own.law !== null && !answersOwnDent(own.law) && !answersOwnDent(own.requested_law);
    const push = pushWords(told ? own.felt_from_others : 0, who);
    this.write(this.push, push, who);
    // While somebody pushes, the line need not say that somebody has come.
    if (view !== null && event !== undefined && (push === "" || event.kind === "left")) this.write(this.news, newsWords(event), [event]);
    else this.write(this.news, push === "" ? pressWords(who) : "", who);
  }

  /** Write a line, in the colour of the user whom it is about if there is only one. */
  private write(line: HTMLElement, words: string, [first, second]: readonly Person[]): void {
    show(line, words !== "");
    say(line, words);
    line.style.setProperty("--user", first === undefined || second !== undefined ? "var(--ink)" : this.colour(first.user));
  }
}
