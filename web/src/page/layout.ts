/** Arrangement of the parts of the page. */

import { el } from "../ui/dom";

export interface Parts {
  readonly toolbar: HTMLElement;
  readonly column: HTMLElement;
  readonly dock: HTMLElement;
  readonly legend: HTMLElement;
  readonly notice: HTMLElement;
  readonly pill: HTMLElement;
  readonly tour: HTMLElement;
  readonly trace: HTMLElement;
  readonly ghost: HTMLElement;
  readonly replay: HTMLElement;
  readonly help: HTMLElement;
  readonly upload: HTMLElement;
  readonly share: HTMLElement;
  readonly gamepad: HTMLElement;
}

export interface Layout {
  readonly root: HTMLElement;
  /** Holds the canvas; marked busy until there is a picture or no picture can come. */
  readonly host: HTMLElement;
  /** Live region, which screen readers speak. */
  readonly live: HTMLElement;
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
  const stage = el(
    "main",
    { class: "stage", attrs: { "aria-label": "The shared object" } },
    host,
    parts.toolbar,
    parts.ghost,
    parts.trace,
    el("div", { class: "stack" }, parts.notice, parts.pill),
    parts.replay,
    parts.dock,
    parts.legend,
  );
  const skip = el("a", { class: "skip", text: "Skip to the hands", attrs: { href: "#hands" } });
  const root = el("div", { class: "app" }, skip, stage, parts.tour, parts.column, el("div", { class: "dialogs" }, parts.help, parts.upload, parts.share, parts.gamepad), live);
  return { root, host, live };
}

/** Position and height of an element over the stage. */
type Over = Pick<HTMLElement, "offsetTop" | "offsetHeight">;

/**
 * Heights of the stage that are covered at its top and at its foot [px].
 *
 * @param stage Height of the stage.
 * @param replay Height of the bar above the dock.
 * @param trace Force trace of the tour; it stands at the top of a wide stage, otherwise at its foot.
 */
export function covered(stage: number, toolbar: Over, dock: Over, replay: number, trace: Over): [number, number] {
  const { offsetTop: top, offsetHeight: height } = trace;
  const high = height > 0 && 2 * top + height < stage;
  const low = height > 0 && !high;
  return [Math.max(toolbar.offsetHeight, high ? top + height : 0), Math.max(dock.offsetHeight + replay, low ? stage - top : 0)];
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
