/** Mouse, finger, pen and wheel on the stage: on the body they press, beside it they turn the view. */

import { DEPTH, penDepth } from "./finger";

/** The actions that pointers ask for. */
export interface PointerDeeds {
  /** Begin to press at a point of the window; false where there is no body or nobody touches. */
  press(x: number, y: number): boolean;
  slide(x: number, y: number): void;
  hover(x: number, y: number): void;
  release(): void;
  /** In radii of the body. */
  deeper(by: number): void;
  /** Set the depth of the press, in radii. */
  depth(depth: number): void;
  rotate(right: number, up: number): void;
  zoom(factor: number): void;
  /** Someone took the view or the body into the own hand. */
  took(): void;
}

const TURN = 0.0065; // rad for a pixel

interface Down {
  x: number;
  y: number;
}

/** @returns A function that removes the listeners. */
export function attachPointer(canvas: HTMLElement, actions: PointerDeeds): () => void {
  const down = new Map<number, Down>();
  /** The pointer that presses; null while the view is turned. */
  let finger: number | null = null;
  const stop = new AbortController();
  const { signal } = stop;

  canvas.addEventListener(
    "pointerdown",
    (event) => {
      if (event.pointerType === "mouse" && event.button !== 0 && event.button !== 2) return;
      canvas.setPointerCapture(event.pointerId);
      canvas.focus({ preventScroll: true });
      down.set(event.pointerId, { x: event.clientX, y: event.clientY });
      actions.took();
      const may = down.size === 1 && event.button === 0 && !event.altKey;
      if (may && actions.press(event.clientX, event.clientY)) {
        finger = event.pointerId;
        if (event.pointerType === "pen" && event.pressure > 0) actions.depth(penDepth(event.pressure));
      }
    },
    { signal },
  );
  canvas.addEventListener(
    "pointermove",
    (event) => {
      const before = down.get(event.pointerId);
      if (before === undefined) {
        if (event.pointerType !== "touch") actions.hover(event.clientX, event.clientY);
        return;
      }
      const dx = event.clientX - before.x;
      const dy = event.clientY - before.y;
      const spread = distance(down);
      before.x = event.clientX;
      before.y = event.clientY;
      if (finger === event.pointerId) {
        if (event.pointerType === "pen" && event.pressure > 0) actions.depth(penDepth(event.pressure));
        if (event.shiftKey) actions.deeper(0.002 * dy);
        else actions.slide(event.clientX, event.clientY);
      } else if (finger !== null) {
        // A second finger beside the one that presses: down is deeper.
        actions.deeper(0.002 * dy);
      } else if (down.size === 2 && spread > 0) {
        actions.zoom(spread / Math.max(1, distance(down)));
        actions.rotate(-0.5 * TURN * dx, 0.5 * TURN * dy);
      } else {
        actions.rotate(-TURN * dx, TURN * dy);
      }
    },
    { signal },
  );
  const up = (event: PointerEvent): void => {
    down.delete(event.pointerId);
    if (finger !== event.pointerId) return;
    finger = null;
    actions.release();
  };
  canvas.addEventListener("pointerup", up, { signal });
  canvas.addEventListener("pointercancel", up, { signal });
  canvas.addEventListener("contextmenu", (event) => { event.preventDefault(); }, { signal });
  canvas.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      const notches = event.deltaY / (event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 3 : 100);
      if (finger !== null) actions.deeper(-DEPTH.notch * Math.max(-3, Math.min(3, notches)));
      else actions.zoom(1.1 ** Math.max(-3, Math.min(3, notches)));
    },
    { signal, passive: false },
  );
  return () => {
    stop.abort();
  };
}

/** Between the first two pointers [px]; 0 of fewer. */
function distance(down: ReadonlyMap<number, Down>): number {
  const [a, b] = [...down.values()];
  return a === undefined || b === undefined ? 0 : Math.hypot(a.x - b.x, a.y - b.y);
}
