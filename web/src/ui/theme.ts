/** Light and dark scheme: as the system prefers, until the visitor chooses. */

import type { Scheme } from "../model/colours";

const KEY = "cohaptic.theme";

export class Theme {
  private readonly system = matchMedia("(prefers-color-scheme: dark)");
  /** Kept, since a query that is read between a change and the word of it says no word of it any more (Chromium). */
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

/** Storage may be forbidden; a page without memory is still a page. */
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
    // Nothing is lost but the memory of a preference.
  }
}
