/** Arrangement of the parts of the page. */

import { el } from "../ui/dom";

export interface Parts {
  readonly toolbar: HTMLElement;
  readonly panel: HTMLElement;
  readonly dock: HTMLElement;
  readonly legend: HTMLElement;
  readonly notice: HTMLElement;
  readonly tour: HTMLElement;
  readonly trace: HTMLElement;
  readonly ghost: HTMLElement;
  readonly help: HTMLElement;
  readonly upload: HTMLElement;
  readonly share: HTMLElement;
}

export interface Layout {
  readonly root: HTMLElement;
  /** Holds the canvas; busy until there is a picture, or none to come. */
  readonly host: HTMLElement;
  /** Speaks to those who do not see the page. */
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
    el("div", { class: "stack" }, parts.notice),
    parts.dock,
    parts.legend,
  );
  const skip = el("a", { class: "skip", text: "Skip to the hands", attrs: { href: "#hands" } });
  const root = el("div", { class: "app" }, skip, stage, parts.tour, parts.panel, el("div", { class: "dialogs" }, parts.help, parts.upload, parts.share), live);
  return { root, host, live };
}

/** The panel beside the stage, or the stage alone. */
export function togglePanel(root: HTMLElement, button: HTMLButtonElement): void {
  const closed = root.classList.toggle("no-panel");
  button.setAttribute("aria-expanded", `${!closed}`);
}

export function toggleFullScreen(): void {
  const done = document.fullscreenElement === null ? document.documentElement.requestFullscreen() : document.exitFullscreen();
  // A browser may refuse; the page stays as it is.
  done.catch(() => undefined);
}
