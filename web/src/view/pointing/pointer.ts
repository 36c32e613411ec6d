/** Mouse, finger, pen and wheel on the stage: on the body they press, beside the body they turn the view. */

import { DEPTH, penDepth } from "./finger";

/** The actions that pointers ask for. */
export interface PointerActions {
  /** Begin to press at a point of the window; false if there is no body or the visitor cannot touch. */
  press(x: number, y: number): boolean;
  /** Point at the place under a point of the window; false if there is none, or the visitor may not point. */
  point(x: number, y: number): boolean;
  /** Whether the next press points and does nothing else. */
  pointing(): boolean;
  slide(x: number, y: number): void;
  hover(x: number, y: number): void;
  release(): void;
  /** Deepen the press by a length in radii of the body. */
  deeper(by: number): void;
  /** Set the depth of the press, in radii. */
  depth(depth: number): void;
  rotate(right: number, up: number): void;
  zoom(factor: number): void;
  /** The visitor began to move the view or to press. */
  took(): void;
}

const TURN = 0.0065; // rad per pixel
const TWICE = 350; // ms; longest time between two presses at one place that point at it
const HELD = 600; // ms; a press that grasps nothing points after this time
const SAME = 16; // px; distance within which two places count as the same
const FIRST = 1; // bit of the first button
const DEEPER = 0.002; // radii of the body per pixel

interface Position {
  x: number;
  y: number;
}

/** @returns A function that removes the listeners. */
export function attachPointer(canvas: HTMLElement, actions: PointerActions): () => void {
  const stop = new AbortController();
  const { signal } = stop;
  const pointers = new Pointers(canvas, actions);
  canvas.addEventListener("pointerdown", (event) => { pointers.down(event); }, { signal });
  canvas.addEventListener("pointermove", (event) => { pointers.move(event); }, { signal });
  canvas.addEventListener("pointerup", (event) => { pointers.up(event); }, { signal });
  canvas.addEventListener("pointercancel", (event) => { pointers.up(event); }, { signal });
  // After a lost capture no further event of the pointer may come here, not even its end.
  canvas.addEventListener("lostpointercapture", (event) => { pointers.up(event); }, { signal });
  canvas.addEventListener("contextmenu", (event) => { event.preventDefault(); }, { signal });
  canvas.addEventListener("wheel", (event) => { pointers.wheel(event); }, { signal, passive: false });
  return () => {
    stop.abort();
    pointers.drop();
  };
}

/** The pointers that are down, one of which may press. */
class Pointers {
  private readonly positions = new Map<number, Position>();
  /** The pointer that presses; null while the view is turned. */
  private finger: number | null = null;
  private last = { x: 0, y: 0, at: -Infinity };
  /** Timer of a press that points when it is held. */
  private holding = 0;

  constructor(
    private readonly canvas: HTMLElement,
    private readonly actions: PointerActions,
  ) {}

  down(event: PointerEvent): void {
    if (event.pointerType === "mouse" && event.button !== 0 && event.button !== 2) return;
    this.canvas.setPointerCapture(event.pointerId);
    this.canvas.focus({ preventScroll: true, focusVisible: false }); // the focus frame is for keyboard users
    this.positions.set(event.pointerId, { x: event.clientX, y: event.clientY });
    this.actions.took();
    const { last } = this;
    const twice = event.timeStamp - last.at < TWICE && Math.hypot(event.clientX - last.x, event.clientY - last.y) < SAME;
    this.last = { x: event.clientX, y: event.clientY, at: event.timeStamp };
    const alone = this.positions.size === 1 && event.button === 0;
    if (alone && this.actions.pointing()) {
      this.actions.point(event.clientX, event.clientY);
      return;
    }
    if (alone && twice) this.actions.point(event.clientX, event.clientY);
    const mayPress = this.positions.size === 1 && event.button === 0 && !event.altKey;
    if (mayPress && this.actions.press(event.clientX, event.clientY)) {
      this.finger = event.pointerId;
      this.pen(event);
    } else if (alone) {
      // A visitor who may not touch, or has no hand to press with, points by a long press.
      this.holding = window.setTimeout(() => { this.actions.point(event.clientX, event.clientY); }, HELD);
    }
  }

  move(event: PointerEvent): void {
    const { actions, positions } = this;
    const before = positions.get(event.pointerId);
    if (before === undefined) {
      if (event.pointerType !== "touch") actions.hover(event.clientX, event.clientY);
      return;
    }
    if (Math.hypot(event.clientX - this.last.x, event.clientY - this.last.y) > SAME) clearTimeout(this.holding);
    // Only the first button down and the last button up of a mouse or pen (its tip is the first) have events; the others come in moves.
    if (this.finger === event.pointerId && event.pointerType !== "touch" && (event.buttons & FIRST) === 0) this.letGo();
    const dx = event.clientX - before.x;
    const dy = event.clientY - before.y;
    const spread = distance(positions);
    before.x = event.clientX;
    before.y = event.clientY;
    if (this.finger === event.pointerId) {
      this.pen(event);
      if (event.shiftKey) actions.deeper(DEEPER * dy);
      else actions.slide(event.clientX, event.clientY);
    } else if (this.finger !== null) {
      // A second finger beside the pressing one sets the depth: down is deeper.
      actions.deeper(DEEPER * dy);
    } else if (positions.size === 2 && spread > 0) {
      actions.zoom(spread / Math.max(1, distance(positions)));
      actions.rotate(-0.5 * TURN * dx, 0.5 * TURN * dy);
    } else {
      actions.rotate(-TURN * dx, TURN * dy);
    }
  }

  up(event: PointerEvent): void {
    this.positions.delete(event.pointerId);
    clearTimeout(this.holding);
    if (this.finger === event.pointerId) this.letGo();
  }

  /** Release the press, because no event of the pointers may come any more. */
  drop(): void {
    this.positions.clear();
    clearTimeout(this.holding);
    if (this.finger !== null) this.letGo();
  }

  private letGo(): void {
    this.finger = null;
    this.actions.release();
  }

  wheel(event: WheelEvent): void {
    event.preventDefault();
    const notches = event.deltaY / (event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 3 : 100);
    if (this.finger !== null) this.actions.deeper(-DEPTH.notch * Math.max(-3, Math.min(3, notches)));
    else this.actions.zoom(1.1 ** Math.max(-3, Math.min(3, notches)));
  }

  private pen(event: PointerEvent): void {
    if (event.pointerType === "pen" && event.pressure > 0) this.actions.depth(penDepth(event.pressure));
  }
}

/** Distance between the first two pointers [px]; 0 for fewer. */
function distance(positions: ReadonlyMap<number, Position>): number {
  const [a, b] = [...positions.values()];
  return a === undefined || b === undefined ? 0 : Math.hypot(a.x - b.x, a.y - b.y);
}
