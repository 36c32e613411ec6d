/** Translates the events of pointers and keys into actions of the page. */

import type { CompanyCorner } from "../company/corner";
import type { SceneStore } from "../model/scene";
import { actionOf, type KeyAction, keyOf } from "../ui/keyboard";
import type { Vec3 } from "../model/vec";
import { DEPTH } from "../view/pointing/finger";
import { HOME, type Orbit, rotated, zoomed } from "../view/orbit";
import { attachPointer } from "../view/pointing/pointer";
import type { Stage } from "../view/stage";
import { toggleFullScreen } from "./layout";
import type { OwnHand } from "./own_hand";
import type { ReplayPlace } from "./replay/place";
import type { Tour } from "./tour";

/** The actions of the page that pointers and keys may use. */
export interface PageActions {
  /** The stage; null until the graphics are loaded, and without WebGL. */
  readonly stage: Stage | null;
  readonly own: OwnHand;
  readonly store: SceneStore;
  readonly tour: Pick<Tour, "running" | "yield">;
  readonly replay: ReplayPlace;
  /** Press where a ray meets the object, and join the room for that; false where there is nothing to press. */
  press(origin: Vec3, direction: Vec3): boolean;
  /**
   * Bring the visitor's hand into the room, or take it out.
   *
   * @param wait Whether to wait for a place if the room is full.
   */
  touch(on: boolean, wait?: boolean): void;
  readonly company: Pick<CompanyCorner, "armed" | "point" | "followNext" | "following" | "moved">;
  /** Turn the camera to a view. */
  look(orbit: Orbit): void;
  toggleTour(): void;
  /** Switch between a past time and the present; with `bar`, show or hide the bar for that. */
  lookBack(bar: boolean): void;
  toggleTheme(): void;
  /** Open or close a panel. */
  toggle(panel: string): void;
  /** The tab went to the background (`hide`), and came back (`wake`). */
  hide(): void;
  wake(): void;
}

const TURN = 0.12; // rad for an arrow key

export function attachKeys(page: PageActions): void {
  let held = false; // whether the space bar is held, which presses
  const letGo = (): void => {
    if (held) page.own.release();
    held = false;
  };
  addEventListener("keydown", (event) => {
    const target = event.target instanceof HTMLElement ? event.target : null;
    // In an open dialog keys belong to the dialog, but for the one that opened it.
    const dialog = document.querySelector("dialog[open]");
    if (dialog === null && page.replay.key(event)) {
      event.preventDefault();
      return;
    }
    const action = actionOf(event, target);
    if (action === null || (dialog !== null && dialog.id !== action)) return;
    if (event.repeat && action === "press") {
      event.preventDefault();
      return;
    }
    event.preventDefault();
    held ||= action === "press";
    act(page, action);
  });
  addEventListener("keyup", (event) => {
    if (keyOf(event) === " ") letGo();
  });
  // This window does not hear of a key that goes up while another window has the focus.
  addEventListener("blur", letGo);
  document.addEventListener("visibilitychange", () => {
    // Nobody watches a hand in the background, so the hand lets go.
    if (document.hidden) page.hide();
    else page.wake();
  });
  addEventListener("pagehide", () => {
    page.hide();
    page.own.stop();
  });
}

/** @returns A function that removes the listeners. */
export function attachPointers(page: PageActions, stage: Stage, host: HTMLElement): () => void {
  // Offset between the point seen under the pointer and the picture without lean, for a press while the camera turns back [px].
  let beside = { x: 0, y: 0 };
  // The dock grows with the first press and moves the picture under the finger; the hand must not move along with it.
  let moved = stage.moved;
  const ray = (x: number, y: number): ReturnType<typeof stage.ray> =>
    stage.ray(x + beside.x + stage.moved.x - moved.x, y + beside.y + moved.y - stage.moved.y);
  return attachPointer(host, {
    press: (x, y) => {
      const { origin, direction } = stage.seen(x, y);
      if (!page.press(origin, direction)) return false;
      const { held } = page.own;
      const straight = held === null || (stage.leaning?.angle ?? 0) === 0 ? { x, y } : stage.unleaned(held.point);
      beside = { x: straight.x - x, y: straight.y - y };
      ({ moved } = stage);
      return leanOver(page, stage);
    },
    point: (x, y) => {
      const { origin, direction } = stage.seen(x, y);
      return pointAt(page, origin, direction);
    },
    pointing: () => page.company.armed,
    slide: (x, y) => {
      const { origin, direction } = ray(x, y);
      if (!page.replay.active) page.own.slide(origin, direction);
    },
    hover: (x, y) => {
      const { origin, direction } = stage.seen(x, y);
      if (!page.tour.running && !page.replay.active) page.own.hover(origin, direction);
    },
    release: () => { page.own.release(); },
    deeper: (by) => { if (!page.replay.active) page.own.deeper(by); },
    depth: (depth) => { if (!page.replay.active) page.own.depth(depth); },
    rotate: (right, up) => { stage.target = rotated(stage.target, right, up); stage.touch(); page.company.moved(); },
    zoom: (factor) => { stage.target = zoomed(stage.target, factor); stage.touch(); page.company.moved(); },
    took: () => { page.tour.yield(); },
  });
}

/** Lean the camera off the normal of the pressed place while the press lasts, but not while the page follows a user's view. */
function leanOver(page: PageActions, stage: Stage): true {
  if (!stage.still && page.company.following === null) void lean(page, stage);
  return true;
}

async function lean({ own, store }: PageActions, stage: Stage): Promise<void> {
  try {
    stage.leaning ??= new (await import("../view/pointing/leaning")).Leaning();
  } catch {
    return; // the picture stays as it is, and the next press asks again
  }
  stage.leaning.hold(own, stage.straight, store.info?.body.radius ?? 0);
}

/** Point at the present object; not in a replay, whose picture shows another time. */
function pointAt(page: PageActions, origin: Vec3, direction: Vec3): boolean {
  return !page.replay.active && page.company.point(origin, direction);
}

/** Do what a key does, or the button that shows this key. */
export function act(page: PageActions, action: KeyAction): void {
  const stage = page.stage;
  const turn = (right: number, up: number): void => {
    if (stage === null) return;
    stage.target = rotated(stage.target, right, up);
    stage.touch();
    page.company.moved();
  };
  const zoom = (factor: number): void => {
    if (stage === null) return;
    stage.target = zoomed(stage.target, factor);
    stage.touch();
    page.company.moved();
  };
  const actions: Record<KeyAction, () => void> = {
    left: () => { turn(-TURN, 0); },
    right: () => { turn(TURN, 0); },
    up: () => { turn(0, TURN); },
    down: () => { turn(0, -TURN); },
    closer: () => { zoom(1 / 1.12); },
    farther: () => { zoom(1.12); },
    reset: () => { page.look(HOME); },
    full: toggleFullScreen,
    touch: () => { page.touch(page.own.handle === null); },
    press: () => {
      const middle = stage?.middle();
      if (stage !== null && middle !== undefined && page.press(middle.origin, middle.direction)) leanOver(page, stage);
    },
    point: () => {
      const middle = stage?.middle();
      if (middle !== undefined) pointAt(page, middle.origin, middle.direction);
    },
    follow: () => { page.company.followNext(); },
    deeper: () => { page.own.deeper(DEPTH.notch); },
    shallower: () => { page.own.deeper(-DEPTH.notch); },
    tour: () => { page.toggleTour(); },
    replay: () => { page.lookBack(false); },
    delay: () => { page.replay.delay(); },
    theme: () => { page.toggleTheme(); },
    help: () => { page.toggle("help"); },
    escape: () => {
      if (page.tour.running) page.toggleTour();
      else page.touch(false);
    },
  };
  actions[action]();
}
