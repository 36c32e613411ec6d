/** What others do, over the stage: who came and who left, who presses, and whom of them one feels. */

import type { TouchState } from "../model/hand";
import type { RoomEvent, SceneSnapshot, SceneStore } from "../model/scene";
import { answersOwnDent } from "../model/laws";
import { norm } from "../model/vec";
import { el, say, show } from "../ui/dom";
import { fixed, named } from "../ui/words";
import { LEAST_FORCE } from "../view/pose";

const LASTS = 5; // s for which news are seen
const LEAST_FELT = 0.05; // N, what a fingertip just tells apart from nothing
/** For which a press that has ended counts [s], and how many lags of the room: its force leaves the object so slowly. */
const [AFTER, LAGS] = [0.3, 3];
const LONGEST = 32; // letters of two names that are told together: more would hide the object on a phone

export interface Person {
  readonly user: number;
  readonly name: string;
}

const called = ({ user, name }: Person): string => (name === "" ? `User ${user}` : named(name));

/** The others whose force the object takes at a moment. */
export function pressing(view: Pick<SceneSnapshot, "users">, own: number, { frozen, muted }: SceneStore["restraints"]): Person[] {
  return view.users.filter(({ user, c_ii, force }) => !frozen && user !== own && c_ii > 0 && norm(force) > LEAST_FORCE && !muted.includes(user));
}

/** What they do; of more than two, or where one alone cannot be told from the others, of all together. */
function together(who: readonly Person[], one: string, several: string): string {
  const [first, second, ...more] = who.map(called);
  if (first === undefined) return "";
  if (second === undefined) return `${first} ${one}`;
  return `${more.length === 0 && first.length + second.length <= LONGEST ? `${first} and ${second}` : "Others"} ${several}`;
}

export const pressWords = (who: readonly Person[]): string => together(who, "presses.", "press.");

/**
 * What a hand feels from others, in words; nothing where nobody is known to cause it.
 *
 * @param felt Part of its force that is theirs; negative where they draw the surface away [N].
 * @param who Presses, or did a moment ago.
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
  /** When others were last seen to press. */
  private readonly pressed = new Map<number, Person & { readonly at: number }>();

  constructor(private readonly colour: (user: number) => string) {}

  /**
   * Some times a second.
   *
   * @param view Of now; null where nobody can tell what others do.
   */
  update(view: SceneSnapshot | null, own: TouchState | null, { events, restraints }: Pick<SceneStore, "events" | "restraints">, now: number): void {
    if (own !== null && own.user > 0) this.mine.set(own.user, own.name);
    const joining = own?.user === 0 && own.place === null; // the next who comes may be the visitor
    const event = events.findLast(({ kind, at, user, name }) => (kind === "joined" || kind === "left") && now - at < LASTS && !joining && this.mine.get(user) !== name);
    for (const { user, name } of view === null ? [] : pressing(view, own?.user ?? 0, restraints)) {
      if (this.mine.get(user) !== name) this.pressed.set(user, { user, name, at: now });
    }
    for (const [user, { at }] of this.pressed) {
      if (view === null || now - at > AFTER + LAGS * view.room.lag) this.pressed.delete(user);
    }
    const who = [...this.pressed.values()].sort((a, b) => a.user - b.user);
    // Under the paper's laws the own dent, which comes back late, is in it too.
    const told = own?.doing === "touching" && own.law !== null && !answersOwnDent(own.law) && !answersOwnDent(own.requested_law);
    const push = pushWords(told ? own.felt_from_others : 0, who);
    this.write(this.push, push, who);
    // That one has come who pushes need not be said.
    if (view !== null && event !== undefined && (push === "" || event.kind === "left")) this.write(this.news, newsWords(event), [event]);
    else this.write(this.news, push === "" ? pressWords(who) : "", who);
  }

  /** In the colour of the one whom it is about. */
  private write(line: HTMLElement, words: string, [first, second]: readonly Person[]): void {
    show(line, words !== "");
    say(line, words);
    line.style.setProperty("--user", first === undefined || second !== undefined ? "var(--ink)" : this.colour(first.user));
  }
}
