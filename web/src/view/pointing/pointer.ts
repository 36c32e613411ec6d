/** Mouse, finger, pen and wheel on the stage: on the body they press, beside it they turn the view. */

import { DEPTH, penDepth } from "./finger";

/** The actions that pointers ask for. */
export interface PointerActions {
  /** Begin to press at a point of the window; false where there is no body or nobody touches. */
  press(x: number, y: number): boolean;
  /** Point at what is there; false where there is nothing, or one may not. */
  point(x: number, y: number): boolean;
  /** Whether the next press points and does nothing else. */
  pointing(): boolean;
  slide(x: number, y: number): void;
  hover(x: number, y: number): void;
  release(): void;
  /** In radii of the body. */
  deeper(by: number): void;
  /** Set the depth of the press, in radii. */
  depth(depth: number): void;
  rotate(right: number, up: number): void;
  zoom(factor: number): void;
  /** The visitor began to move the view or to press. */
  took(): void;
}

const TURN = 0.0065; // rad for a pixel
const TWICE = 350; // ms between two presses at one place that point at it
const HELD = 600; // ms of a press that holds nothing, and points therefore
const SAME = 16; // px that a finger may be off
const FIRST = 1; // of the buttons, as bits
const DEEPER = 0.002; // radii of the body for a pixel

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
  // After this no event of the pointer need come here, not even its end.
  canvas.addEventListener("lostpointercapture", (event) => { pointers.up(event); }, { signal });
  canvas.addEventListener("contextmenu", (event) => { event.preventDefault(); }, { signal });
  canvas.addEventListener("wheel", (event) => { pointers.wheel(event); }, { signal, passive: false });
  return () => {
    stop.abort();
    pointers.drop();
  };
}

/** The pointers that are down, and the one that presses. */
class Pointers {
  private readonly positions = new Map<number, Position>();
  /** The pointer that presses; null while the view is turned. */
  private finger: number | null = null;
  private last = { x: 0, y: 0, at: -Infinity };
  /** Of a press that may become one that points by being held. */
  private holding = 0;

  constructor(
    private readonly canvas: HTMLElement,
    private readonly actions: PointerActions,
  ) {}

  down(event: PointerEvent): void {
    if (event.pointerType === "mouse" && event.button !== 0 && event.button !== 2) return;
    this.canvas.setPointerCapture(event.pointerId);
    this.canvas.focus({ preventScroll: true, focusVisible: false }); // its frame is for keys
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
      // Who may not touch, or has no hand to press with, points with a long press.
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
    // Of several buttons of a mouse or a pen (its tip is the first) the first that goes down and the last that goes up are told alone; the others in moves.
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
      // A second finger beside the one that presses: down is deeper.
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

  /** Nothing is heard of the pointers any more: what they held is let go of. */
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

/** Between the first two pointers [px]; 0 of fewer. */
function distance(positions: ReadonlyMap<number, Position>): number {
  const [a, b] = [...positions.values()];
  return a === undefined || b === undefined ? 0 : Math.hypot(a.x - b.x, a.y - b.y);
}
