/** Arrangement of the parts of the page. */

import { el } from "../ui/dom";
import type { Column } from "../ui/cards/column";
import type { Toolbar } from "../ui/toolbar";

export interface Parts {
  readonly toolbar: Pick<Toolbar, "root" | "end">;
  readonly column: Pick<Column, "root" | "offers" | "end">;
  readonly pill: HTMLElement;
  readonly tour: HTMLElement;
  readonly trace: HTMLElement;
  readonly replay: HTMLElement;
}

/**
 * Where a panel's element lies: over the object, among the notices over the stage, at the foot of the stage, among the
 * buttons on top, among the offers of the column, below its cards, or among the dialogs.
 */
export type Place = "over" | "stack" | "foot" | "tools" | "offers" | "cards" | "dialogs";

/**
 * Puts an element at a place, after those that are there already.
 *
 * @param covers Whether the element covers the foot of the stage, of which the object then stays clear.
 */
export type Put = (place: Place, part: HTMLElement, covers?: boolean) => void;

export interface Layout {
  readonly root: HTMLElement;
  /** Holds the canvas; marked busy until there is a picture or no picture can come. */
  readonly host: HTMLElement;
  /** Live region, which screen readers speak. */
  readonly live: HTMLElement;
  readonly put: Put;
  /** Heights of the stage that are covered at its top and at its foot [px]; `replay` is that of the bar above the dock. */
  covered(replay: number): [number, number];
}

export function layOut(parts: Parts): Layout {
  const host = el("div", {
    class: "stage-host",
    attrs: {
      role: "application",
      tabindex: "0",
      "aria-busy": "true",
      "aria-label": "The object in three dimensions. Arrow keys turn it, plus and minus zoom, T touches, space presses, question mark for help.",
    },
  });
  const live = el("div", { class: "for-ears", attrs: { role: "status", "aria-live": "polite" } });
  const stack = el("div", { class: "stack" }, parts.pill);
  const stage = el(
    "main",
    { class: "stage", attrs: { "aria-label": "The shared object" } },
    host,
    parts.toolbar.root,
    parts.trace,
    stack,
    parts.replay,
  );
  const skip = el("a", { class: "skip", text: "Skip to the hands", attrs: { href: "#hands" } });
  const dialogs = el("div", { class: "dialogs" });
  const root = el("div", { class: "app" }, skip, stage, parts.tour, parts.column.root, dialogs, live);
  // The parent of each place, and the element before which the place ends; null for the end of the parent.
  const places: Readonly<Record<Place, readonly [HTMLElement, HTMLElement | null]>> = {
    over: [stage, parts.trace], stack: [stack, parts.pill], foot: [stage, null], tools: [parts.toolbar.root, parts.toolbar.end], offers: [parts.column.offers, null],
    cards: [parts.column.root, parts.column.end], dialogs: [dialogs, null],
  };
  const low: HTMLElement[] = [];
  const put: Put = (place, part, covers = false) => {
    const [parent, end] = places[place];
    parent.insertBefore(part, end);
    if (covers) low.push(part);
  };
  return {
    root, host, live, put,
    covered: (replay) => covered(host.offsetHeight, parts.toolbar.root, low.reduce((sum, { offsetHeight }) => sum + offsetHeight, replay), parts.trace),
  };
}

/** Position and height of an element over the stage. */
type Over = Pick<HTMLElement, "offsetTop" | "offsetHeight">;

/**
 * Heights of the stage that are covered at its top and at its foot [px].
 *
 * @param stage Height of the stage.
 * @param foot Height of the parts at its foot.
 * @param trace Force trace of the tour; it stands at the top of a wide stage, otherwise at its foot.
 */
export function covered(stage: number, toolbar: Over, foot: number, trace: Over): [number, number] {
  const { offsetTop: top, offsetHeight: height } = trace;
  const high = height > 0 && 2 * top + height < stage;
  const low = height > 0 && !high;
  return [Math.max(toolbar.offsetHeight, high ? top + height : 0), Math.max(foot, low ? stage - top : 0)];
}

/**
 * Mark whether the page shows the past or the present, so that the past never looks like the present.
 *
 * @param then Whether the server was heard at the time that a replay shows; null for no replay.
 * @param now Whether the server is heard now; the dock shows the present, also beside a replay.
 */
export function showTime(root: HTMLElement, then: boolean | null, now: boolean): void {
  root.classList.toggle("replaying", then !== null);
  root.classList.toggle("stale", !(then ?? now));
  root.classList.toggle("deaf", !now);
}

/** Switch between the column beside the stage and the stage alone. */
export function togglePanel(root: HTMLElement, button: HTMLButtonElement): void {
  const closed = root.classList.toggle("no-panel");
  button.setAttribute("aria-expanded", `${!closed}`);
}

export function toggleFullScreen(): void {
  const done = document.fullscreenElement === null ? document.documentElement.requestFullscreen() : document.exitFullscreen();
  // A browser may refuse; the page stays as it is.
  done.catch(() => undefined);
}
