/** Light or dark colour scheme: that of the system until the visitor chooses one. */

import type { Scheme } from "../model/colours";

const KEY = "cohaptic.theme";

export class Theme {
  private readonly system = matchMedia("(prefers-color-scheme: dark)");
  /** Kept, because in Chromium a query that is read between a change and its event does not report the event any more. */
  private dark = this.system.matches;
  private chosen: Scheme | null;
  private readonly changed: (scheme: Scheme) => void;

  constructor(changed: (scheme: Scheme) => void) {
    this.changed = changed;
    const kept = recall(KEY);
    this.chosen = kept === "light" || kept === "dark" ? kept : null;
    this.system.addEventListener("change", ({ matches }) => {
      this.dark = matches;
      this.apply();
    });
  }

  get scheme(): Scheme {
    return this.chosen ?? (this.dark ? "dark" : "light");
  }

  apply(): void {
    document.documentElement.dataset["theme"] = this.scheme;
    this.changed(this.scheme);
  }

  switch(): void {
    this.chosen = this.scheme === "dark" ? "light" : "dark";
    keep(KEY, this.chosen);
    this.apply();
  }
}

/** Stored value of a key; null if there is none, or if the visitor forbids storage. */
export function recall(key: string): string | null {
  try {
    return localStorage.getItem(key);
  } catch {
    return null;
  }
}

export function keep(key: string, value: string): void {
  try {
    localStorage.setItem(key, value);
  } catch {
    // Without storage only the preference is lost.
  }
}
