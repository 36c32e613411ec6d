/** The panels of a page that shows a recorded session: what is not shown, its moments, and why a force was as it was. */

import type { RecordedSession } from "../model/recording";
import type { SceneSnapshot } from "../model/scene";
import { norm } from "../model/vec";
import type { Panel } from "../page/panels";
import { dialog } from "../panels/dialog";
import { legend } from "../panels/legend";
import { notice } from "../panels/notice";
import { fill, type Row, row } from "../ui/cards/force_ledger";
import { el, say, show } from "../ui/dom";
import { clockTime } from "../ui/replay/words";
import { type Why, WhyAsker } from "./why";

const MOST_LISTED = 500; // moments; more are on the line only, and the keys reach them
const LEAST = 1; // N; the bars of a smaller force are no longer
const SEEN = 0.005; // N; a smaller entry is not listed

/** What else is known of a session. */
export interface About {
  /** Unix time of its first entry [s]. */
  readonly began: number;
  /** Number of moments that are not listed. */
  readonly further: number;
  /** Whether the file was closed. */
  readonly complete: boolean;
}

/** @param unshown Why the deformation at a time is not shown, in a sentence; empty if it is. */
export function sessionPanels(
  session: RecordedSession, about: About, unshown: (t: number) => string, fetchWhy: (user: number, t: number) => Promise<string>,
): readonly Panel[] {
  return [notice, legend, restingNote(unshown), moments(session, about), why(fetchWhy), dialog("help", async () => new (await import("../ui/help")).Help(true))];
}

/** Says that the surface is shown at rest, and how high the bar is. */
function restingNote(unshown: (t: number) => string): Panel {
  return {
    id: "unshown",
    mount: (page, put) => {
      const words = el("p", { class: "session-note", attrs: { role: "status" } });
      put("stack", words);
      return {
        update: () => {
          page.root.style.setProperty("--replay", `${page.replay.height}px`); // which the legend stays clear of
          const said = page.shown === null ? "" : unshown(page.shown.t_server);
          say(words, said);
          show(words, said !== "");
        },
      };
    },
  };
}

/** The moments as a list; who presses one goes there. */
function moments(session: RecordedSession, { further, complete, began }: About): Panel {
  return {
    id: "moments",
    mount: (page, put) => {
      const listed = session.moments.slice(0, MOST_LISTED);
      const buttons = listed.map(({ t, kind, text }) =>
        el("button", { class: `moment ${kind}`, attrs: { type: "button" }, on: { click: () => { session.wanted = t; } } },
          el("span", { class: "moment-time", text: clockTime(t - session.first) }), el("span", { class: "moment-text", text })));
      const rest = session.moments.length - listed.length + further;
      const root = el(
        "section",
        { class: "card session-moments", attrs: { "aria-label": "Marks and events" } },
        el("h3", { class: "session-title", text: "Marks and events" }),
        el("p", { class: "fine session-name", text: `${session.name}, recorded ${new Date(1000 * began).toLocaleString()}` }),
        listed.length === 0 ? el("p", { class: "fine", text: "There are none in this session." }) : el("ol", { class: "moments" }, ...buttons.map((button) => el("li", {}, button))),
        rest === 0 ? null : el("p", { class: "fine", text: `And ${rest} more.` }),
        complete ? null : el("p", { class: "fine", text: "The recording was cut short: its process was killed." }),
      );
      put("cards", root);
      let marked = -1;
      return {
        update: () => {
          if (page.shown === null) return;
          const { t_server } = page.shown;
          const at = listed.findLastIndex(({ t }) => t <= t_server);
          if (at === marked) return;
          buttons[marked]?.removeAttribute("aria-current");
          buttons[at]?.setAttribute("aria-current", "true");
          marked = at;
        },
      };
    },
  };
}

/** What each rule did to the force on a hand, with a choice of the hand. */
function why(fetch: (user: number, t: number) => Promise<string>): Panel {
  return {
    id: "why",
    mount: (page, put) => {
      const asker = new WhyAsker(fetch);
      const hands = el("select", { class: "session-hands", attrs: { "aria-label": "Whose force" } });
      const sentence = el("p", { class: "session-sentence" });
      const rows = el("tbody");
      const table = el("table", {}, rows);
      const ledger = el("div", { class: "session-ledger ledger" }, table);
      const root = el(
        "section",
        { class: "card session-why", attrs: { "aria-label": "Why this force" } },
        el("div", { class: "session-line" }, el("h3", { class: "session-title", text: "Why this force" }), hands),
        sentence, ledger,
      );
      put("cards", root);
      let [listed, drawn, by]: [string, Why | null, string | null] = ["", null, null];
      hands.addEventListener("change", () => { by = hands.value; });
      return {
        update: (now) => {
          const { shown } = page;
          if (shown === null) return;
          const users = shown.users.map(({ user, name }) => ({ user, name: name === "" ? `user ${user}` : name }));
          const key = JSON.stringify(users);
          if (key !== listed) {
            const chosen = by ?? strongest(shown.users);
            hands.replaceChildren(...users.map(({ user, name }) => el("option", { text: name, attrs: { value: `${user}` } })));
            if (users.some(({ user }) => `${user}` === chosen)) hands.value = chosen;
            listed = key;
          }
          show(hands, users.length > 0);
          asker.ask(users.length === 0 ? null : Number(hands.value), shown.t_server, now);
          const { answer } = asker;
          say(sentence, answer?.sentence ?? asker.words);
          show(ledger, answer !== null && answer.entries.some(seen));
          if (answer !== null && answer !== drawn) rows.replaceChildren(...rowsOf(answer).map(({ root: one }) => one));
          drawn = answer;
        },
      };
    },
  };
}

/** Number of the user with the largest force. */
function strongest(users: SceneSnapshot["users"]): string {
  const [first] = [...users].sort((a, b) => norm(b.force) - norm(a.force));
  return `${first?.user ?? ""}`;
}

function seen({ newtons }: Why["entries"][number]): boolean {
  return Math.abs(newtons ?? 0) >= SEEN;
}

/** A row with a bar for each rule that did something; a bar begins where the one before ends. */
function rowsOf({ entries }: Why): readonly Row[] {
  const listed = entries.filter(seen);
  let [sum, most] = [0, LEAST];
  for (const { newtons } of listed) most = Math.max(most, (sum += newtons ?? 0));
  let from = 0;
  return listed.map(({ name, newtons, words }) => {
    const made = row(name, words);
    fill(made, from, newtons ?? 0, null, most);
    from += newtons ?? 0;
    return made;
  });
}
