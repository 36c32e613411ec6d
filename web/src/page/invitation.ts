/**
 * The invitation in the link: `#token=...`, which no browser sends to a server.
 *
 * The page takes the token out of the address bar at once, so that nobody reads or copies it there, and keeps it for this
 * tab, so that the page can be reloaded. The token of the session that the invitation begins replaces it. Each room's page
 * has its own token; a page without one takes the last token of the tab, which may be for several rooms.
 *
 * A token in `?token=...` has been sent to the server, and to the logs on the way. The page takes it out of the address bar,
 * too, but does not use it: people would pass on a link that seems to work. A server's redirection leaves an empty `?token=`.
 */

import type { Pass } from "../model/pass";

const INVITATION = "cohaptic.invitation";
const SESSION = "cohaptic.session";
const TOKEN = /^[!-~]{1,2048}$/;

/** The parts of the browser that are needed here. */
export interface Place {
  readonly location: Pick<Location, "hash" | "pathname" | "search">;
  readonly history: Pick<History, "replaceState">;
  /** Storage of this tab; null where the visitor forbids it. */
  readonly storage: Pick<Storage, "getItem" | "setItem" | "removeItem"> | null;
}

export class Invitation implements Pass {
  /** Whether the address had a token before the #. */
  readonly misplaced: boolean;
  /** Token of the link; another window begins a session of its own with it. */
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

  /** Take a token out of the address bar; returns whether there was one. */
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

  /** Take tokens out of the query; returns whether there was one. */
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
      // Without storage the tab forgets the token when it is reloaded.
    }
  }
}

/** The parts of this browser; does not throw where storage is forbidden. */
export function here(): Place {
  let storage: Storage | null = null;
  try {
    storage = sessionStorage;
  } catch {
    // A visitor may forbid storage.
  }
  return { location, history, storage };
}
