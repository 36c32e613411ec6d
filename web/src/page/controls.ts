/** Pointers and keys: translates their events into actions of the page. */

import type { LazyDialog } from "../ui/lazy_dialog";
import { actionOf, type KeyAction } from "../ui/keyboard";
import type { Vec3 } from "../model/vec";
import { DEPTH } from "../view/pointing/finger";
import { HOME, rotated, zoomed } from "../view/orbit";
import { attachPointer } from "../view/pointing/pointer";
import type { Stage } from "../view/stage";
import { toggleFullScreen } from "./layout";
import type { OwnHand } from "./own_hand";
import type { Tour } from "./tour";

/** The actions of the page that pointers and keys may use. */
export interface PageActions {
  /** Null until the graphics are there, and without WebGL. */
  readonly stage: Stage | null;
  readonly own: OwnHand;
  readonly tour: Pick<Tour, "running" | "yield">;
  readonly help: LazyDialog;
  /** Press where a ray meets the object, and come into the room for that; false where there is nothing to press. */
  press(origin: Vec3, direction: Vec3): boolean;
  /** Bring the visitor's hand into the room, or take it out. */
  touch(on: boolean): void;
  toggleTour(): void;
  toggleTheme(): void;
  /** The tab went to the background. */
  hide(): void;
}

const TURN = 0.12; // rad for an arrow key

export function attachKeys(page: PageActions): void {
  addEventListener("keydown", (event) => {
    const target = event.target instanceof HTMLElement ? event.target : null;
    const action = actionOf(event, target);
    // In an open dialog keys belong to the dialog.
    const dialog = document.querySelector("dialog[open]") !== null;
    if (action === null || (dialog && !(page.help.open && action === "help"))) return;
    if (event.repeat && action === "press") {
      event.preventDefault();
      return;
    }
    event.preventDefault();
    act(page, action);
  });
  addEventListener("keyup", (event) => {
    if (event.key === " " && page.own.pressing) page.own.release();
  });
  document.addEventListener("visibilitychange", () => {
    // In the background nobody watches the hand: it lets go.
    if (document.hidden) page.hide();
  });
  addEventListener("pagehide", () => {
    page.own.stop();
  });
}

/** @returns A function that removes the listeners. */
export function attachPointers(page: PageActions, stage: Stage, host: HTMLElement): () => void {
  const ray = (x: number, y: number): ReturnType<typeof stage.ray> => stage.ray(x, y);
  return attachPointer(host, {
    press: (x, y) => {
      const { origin, direction } = ray(x, y);
      return page.press(origin, direction);
    },
    slide: (x, y) => {
      const { origin, direction } = ray(x, y);
      page.own.slide(origin, direction);
    },
    hover: (x, y) => {
      const { origin, direction } = ray(x, y);
      if (!page.tour.running) page.own.hover(origin, direction);
    },
    release: () => { page.own.release(); },
    deeper: (by) => { page.own.deeper(by); },
    depth: (depth) => { page.own.depth(depth); },
    rotate: (right, up) => { stage.target = rotated(stage.target, right, up); stage.touch(); },
    zoom: (factor) => { stage.target = zoomed(stage.target, factor); stage.touch(); },
    took: () => { page.tour.yield(); },
  });
}

function act(page: PageActions, action: KeyAction): void {
  const stage = page.stage;
  const turn = (right: number, up: number): void => {
    if (stage === null) return;
    stage.target = rotated(stage.target, right, up);
    stage.touch();
  };
  const zoom = (factor: number): void => {
    if (stage === null) return;
    stage.target = zoomed(stage.target, factor);
    stage.touch();
  };
  const actions: Record<KeyAction, () => void> = {
    left: () => { turn(-TURN, 0); },
    right: () => { turn(TURN, 0); },
    up: () => { turn(0, TURN); },
    down: () => { turn(0, -TURN); },
    closer: () => { zoom(1 / 1.12); },
    farther: () => { zoom(1.12); },
    reset: () => { stage?.goTo(HOME); },
    full: toggleFullScreen,
    touch: () => { page.touch(page.own.handle === null); },
    press: () => {
      const middle = stage?.middle();
      if (middle !== undefined) page.press(middle.origin, middle.direction);
    },
    deeper: () => { page.own.deeper(DEPTH.notch); },
    shallower: () => { page.own.deeper(-DEPTH.notch); },
    tour: () => { page.toggleTour(); },
    theme: () => { page.toggleTheme(); },
    help: () => { page.help.toggle(); },
    escape: () => {
      if (page.tour.running) page.toggleTour();
      else page.touch(false);
    },
  };
  actions[action]();
}
