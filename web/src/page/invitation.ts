/**
 * The invitation in the link: `#token=...`, which no browser sends to a server.
 *
 * It is taken out of the address bar at once, so that nobody reads or copies it there, and kept for this tab, so that
 * the page can be reloaded. The token of the session that it begins takes its place. Each room's page has its own; one
 * that has none takes what the tab had last, which may be for several rooms.
 *
 * In `?token=...` it has been sent to the server, and to the logs on the way. It is taken out of the address bar too,
 * but not used: a link that seems to work would be passed on. A server's redirection leaves of it the empty `?token=`.
 */

import type { Pass } from "../model/pass";

const INVITATION = "cohaptic.invitation";
const SESSION = "cohaptic.session";
const TOKEN = /^[!-~]{1,2048}$/;

/** What is needed of the browser. */
export interface Place {
  readonly location: Pick<Location, "hash" | "pathname" | "search">;
  readonly history: Pick<History, "replaceState">;
  /** Of this tab; null where a visitor forbids it. */
  readonly storage: Pick<Storage, "getItem" | "setItem" | "removeItem"> | null;
}

export class Invitation implements Pass {
  /** Whether the address had a token before the #. */
  readonly misplaced: boolean;
  /** That was in the link; a session of its own begins with it in another window. */
  invitation: string | undefined;
  private session: string | undefined;

  constructor(private readonly place: Place) {
    for (const where of [place.location.pathname, ""]) {
      this.invitation = this.recall(INVITATION + where);
      this.session = this.recall(SESSION + where);
      if (this.token !== undefined) break;
    }
    this.misplaced = this.cleanQuery();
    this.read();
  }

  get token(): string | undefined {
    return this.session ?? this.invitation;
  }

  /** Take a token out of the address bar; whether there was one. */
  read(): boolean {
    const { location, history } = this.place;
    const fields = new URLSearchParams(location.hash.slice(1));
    const found = fields.get("token");
    if (found === null) return false;
    fields.delete("token");
    const rest = fields.toString();
    history.replaceState(null, "", location.pathname + location.search + (rest === "" ? "" : `#${rest}`));
    if (!TOKEN.test(found)) return false;
    // Another invitation begins another session.
    if (found !== this.invitation) this.store(SESSION, (this.session = undefined));
    this.store(INVITATION, (this.invitation = found));
    return true;
  }

  /** Take tokens out of the query; whether there was one. */
  private cleanQuery(): boolean {
    const { location, history } = this.place;
    const fields = new URLSearchParams(location.search);
    const wrong = [...fields.keys()].filter((name) => name.trim().toLowerCase() === "token");
    if (wrong.length === 0) return false;
    for (const name of wrong) fields.delete(name);
    const rest = fields.toString();
    history.replaceState(null, "", location.pathname + (rest === "" ? "" : `?${rest}`) + location.hash);
    return true;
  }

  keep(session: string): void {
    this.store(SESSION, (this.session = session));
  }

  forget(): boolean {
    const left = this.session !== undefined && this.invitation !== undefined;
    this.store(SESSION, (this.session = undefined));
    return left;
  }

  private recall(key: string): string | undefined {
    try {
      return this.place.storage?.getItem(key) ?? undefined;
    } catch {
      return undefined;
    }
  }

  private store(key: string, value: string | undefined): void {
    try {
      for (const where of [this.place.location.pathname, ""]) {
        if (value === undefined) this.place.storage?.removeItem(key + where);
        else this.place.storage?.setItem(key + where, value);
      }
    } catch {
      // The tab forgets it when it is reloaded.
    }
  }
}

/** This browser's; throws nothing where storage is forbidden. */
export function here(): Place {
  let storage: Storage | null = null;
  try {
    storage = sessionStorage;
  } catch {
    // A visitor may forbid it.
  }
  return { location, history, storage };
}
