/** The visitor's hand: whether it is in the room, its target position, and the law that it presses with. */

import { type RestMesh, sameMesh } from "../model/body";
import type { HandSettings, TouchHandle, TouchSettings, TouchState } from "../model/hand";
import { DEFAULT_LAW, type LawChoice, type LawName, PAPER } from "../model/laws";
import { FULL_FORCE } from "../model/scale";
import type { SceneSnapshot, WatchInfo } from "../model/scene";
import { along, norm, scale, sub, unit, type Vec3 } from "../model/vec";
import { deeper, depart, type Finger, follow, goal, hover, type Place3, press, release, slide } from "../view/pointing/finger";
import type { Place } from "../view/pointing/pick";
import { type Met, Shape } from "../view/shape";

/** Mechanics of a human hand, and of a hand that is held still, like the clamp of the paper's figures. */
export const HANDS: Readonly<Record<"natural" | "firm", HandSettings>> = {
  natural: { mass: 0.15, damping: 8, stiffness: 400 },
  firm: { mass: 0.15, damping: 60, stiffness: 10_000 },
};
const AWAY = 1.3; // radii of the body from its middle, where a hand appears

/** @param beside Whether this is another hand than the visitor's own. */
export type StartTouch = (settings: TouchSettings, beside?: boolean) => TouchHandle;

export class OwnHand {
  handle: TouchHandle | null = null;
  /** Last report of a hand that the server ended; null for none. */
  ended: TouchState | null = null;
  /** The chosen law; the law in use follows with the next patches. */
  law: LawChoice = DEFAULT_LAW;
  /** mu of the finger. */
  friction = 0;
  private readonly startTouch: StartTouch;
  private shape: Shape | null = null;
  private info: WatchInfo | null = null;
  private finger: Finger | null = null;
  private tip: Vec3 = [0, 0, 0];
  private grip: "natural" | "firm" = "natural";
  private paperPending = false;
  private guided: Vec3 | null = null;
  /** Whether a gamepad sets the target of the hand; pointers wait meanwhile. */
  private steered = false;
  /** A press that waits until the hand is in the room and free. */
  private pending: Met | null = null;
  /** Direction from the finger's last place towards the eye of that moment: this way off the object is free. */
  private free_way: Vec3 = [0, 0, 1];
  /** Whether the hand goes off the object along `free_way`, whatever the finger was to do. */
  private leaving = false;
  /** Last place of the finger on the object. */
  private over: Place | null = null;

  constructor(startTouch: StartTouch) {
    this.startTouch = startTouch;
  }

  get state(): TouchState | null {
    return this.handle?.state ?? null;
  }

  /** Drop a hand whose connection the server has closed; its last report stays in `ended`. */
  tidy(): void {
    const state = this.state;
    if (this.handle === null || state?.phase !== "closed") return;
    this.stop();
    this.ended = state;
  }

  get pressing(): boolean {
    return this.finger?.pressing === true || this.pending !== null;
  }

  /** Place on the surface that the visitor's own press holds, as it was when the press began; null without a press. */
  get held(): Place3 | null {
    if (!this.pressing || this.guided !== null || this.leaving) return null;
    if (this.pending !== null || this.finger === null) return this.pending;
    const { surface, normal, offset } = this.finger;
    return { surface, normal, point: along(surface, offset, normal) };
  }

  /**
   * One line about the next step; empty when it is obvious.
   *
   * @param then Whether the page shows a past time, in which nothing can be pressed.
   */
  hint(then: boolean): string {
    const state = this.state;
    if (this.handle === null) return "";
    if (then && state?.phase === "joined" && state.fault === "") return "Your hand is still in the room: this is its force now.";
    if (state?.place) return `The room is full. You wait for a place: place ${state.place[0]} of ${state.place[1]}.`;
    if (state === null || (state.phase === "connecting" && state.user === 0)) return "Joining the room\u2026";
    if (state.phase === "connecting") return "Your hand waits for the server to come back.";
    if (state.fault !== "") return `Force off: ${state.fault}.`;
    if (state.doing === "touching" || this.pressing) return "";
    return "Press on the object and hold; drag to slide, wheel or Shift for depth.";
  }

  setBody(mesh: RestMesh | null, info: WatchInfo | null): void {
    this.info = info;
    if (mesh === null || mesh === this.shape?.mesh) return;
    const another = this.shape !== null && !sameMesh(mesh, this.shape.mesh);
    this.shape = new Shape(mesh);
    this.finger = null;
    if (another && info !== null) this.standOff(info.body);
  }

  /** Move the hand outside, where it can be engaged, because the new object may be where the hand is. */
  private standOff({ center, radius }: WatchInfo["body"]): void {
    const away = sub(this.tip, center);
    this.tip = along(center, AWAY * radius, norm(away) > 0 ? unit(away) : [0, -1, 0]);
    this.paperPending = this.law === "paper"; // the former gains were those of the former object
    this.handle?.point(this.tip);
  }

  /**
   * @param towards Direction from the middle of the body to the place where the hand appears.
   * @param wait Whether to wait for a seat if the room is full.
   */
  start(url: string, name: string, towards: Vec3, wait = false): void {
    if (this.handle !== null || this.info === null) return;
    this.ended = null;
    const { center, radius } = this.info.body;
    this.tip = along(center, AWAY * radius, unit(towards));
    this.handle = this.startTouch({
      url, name, law: this.law === "paper" ? "proportional" : this.law, geometry: "sphere",
      max_force: FULL_FORCE, friction: this.friction, passivity: true, hand: HANDS[this.grip], target: this.tip, wait,
    });
    this.paperPending = this.law === "paper";
  }

  stop(): void {
    const handle = this.handle;
    this.handle = null;
    this.finger = null;
    this.pending = null;
    if (handle !== null) void handle.close();
  }

  setLaw(law: LawChoice): void {
    this.law = law;
    this.paperPending = law === "paper";
    const wire: LawName = law === "paper" ? "proportional" : law;
    if (law !== "paper") this.handle?.setLaw(wire, null);
  }

  /** Change the name; seat, force and place in the queue stay. */
  rename(name: string): void {
    this.handle?.setName(name);
  }

  setFriction(mu: number): void {
    this.friction = mu;
    this.handle?.setFriction(mu);
  }

  /** Hold the tip as a human hand does, or as a clamp does. */
  hold(grip: "natural" | "firm"): void {
    this.grip = grip;
    this.handle?.setHand(HANDS[grip]);
  }

  /** Press the surface where a ray meets it; false if that is not possible. */
  press(origin: Vec3, direction: Vec3, now: number): boolean {
    const place = this.meet(origin, direction);
    if (this.handle === null || place === null || this.steered) return false;
    this.shape?.grasp();
    this.put(place, scale(direction, -1));
    this.guided = null;
    if (!this.free) {
      this.pending = place;
      return true;
    }
    this.finger = press(place, now, this.finger?.depth);
    return true;
  }

  slide(origin: Vec3, direction: Vec3): void {
    const place = this.shape?.meetGrasped(origin, direction) ?? null;
    if (place === null || (this.pending === null && this.finger === null)) return;
    this.put(place, scale(direction, -1));
    if (this.pending !== null) this.pending = place;
    else if (this.finger !== null) this.finger = slide(this.finger, place);
  }

  hover(origin: Vec3, direction: Vec3): void {
    if (this.handle === null || this.pressing || this.steered) return;
    const place = this.meet(origin, direction);
    if (place === null) return;
    this.put(place, scale(direction, -1));
    this.finger = hover(place, this.finger?.depth);
  }

  /** Point of the resting surface that belongs to the place where a ray meets the present surface; null beside it. */
  placeAt(origin: Vec3, direction: Vec3): Vec3 | null {
    return this.meet(origin, direction)?.surface ?? null;
  }

  /** Whether the hand may press: it has joined the room and is engaged. */
  private get free(): boolean {
    const state = this.state;
    return state?.phase === "joined" && state.doing !== "waiting" && state.doing !== "connecting";
  }

  release(): void {
    this.pending = null;
    if (this.finger !== null) this.finger = release(this.finger);
  }

  /** Set the target that a gamepad gives the hand [m]; null gives the hand back to pointers and keys. */
  steer(target: Vec3 | null): void {
    this.steered = target !== null;
    if (target === null || this.handle === null) return;
    this.finger = null;
    this.pending = null;
    this.tip = target;
    this.handle.point(target);
  }

  /**
   * Move the hand well off the object, whatever others do to the object, because nobody watches the hand.
   *
   * @param asleep Whether the page has stopped drawing, so that `step` is not called.
   */
  retreat(asleep = false): void {
    this.release();
    this.leaving = this.finger !== null;
    if (!asleep || !this.leaving || this.info === null) return;
    this.tip = this.departed(this.info.body, Infinity);
    this.handle?.point(this.tip, false);
  }

  private departed({ center, radius }: WatchInfo["body"], dt: number): Vec3 {
    return depart(this.tip, this.free_way, center, radius, AWAY * radius, dt);
  }

  /** Deepen the press by a length in radii of the body. */
  deeper(by: number): void {
    if (this.finger !== null) this.finger = deeper(this.finger, by);
  }

  depth(depth: number): void {
    if (this.finger !== null) this.finger = { ...this.finger, depth };
  }

  /** Press where the surface faces a direction; for the tour, which guides the visitor's hand. */
  guide(direction: Vec3, depth: number, now: number): void {
    if (this.shape === null || this.info === null) return;
    const { center, radius } = this.info.body;
    // A second press would take the own dent for the surface.
    if (this.finger?.pressing === true && this.guided === direction) {
      this.depth(depth);
      return;
    }
    this.guided = direction;
    const met = this.shape.towards(unit(direction), center, radius);
    if (met === null) return;
    this.put(met, unit(direction));
    this.finger = press(met, now, depth);
  }

  /** Move the finger on to time `now` [s], and tell the loop the target of the hand. */
  step(view: SceneSnapshot | null, now: number, dt: number): void {
    if (view !== null && this.shape?.mesh.vertices.length === view.positions.length) this.shape.positions = view.positions;
    const { handle, info } = this;
    handle?.alive();
    if (handle === null || info === null) return;
    if (this.pending !== null && this.free) {
      this.finger = press(this.pending, now, this.finger?.depth);
      this.pending = null;
    }
    if (this.finger !== null) {
      const { center, radius } = info.body;
      const before = this.tip;
      this.finger = this.clear(this.finger);
      if (this.leaving) this.tip = this.departed(info.body, Math.min(dt, 0.1));
      else this.tip = follow(this.tip, goal(this.finger, now, radius), center, radius, Math.min(dt, 0.1));
      if (this.tip !== before) handle.point(this.tip, this.finger.pressing);
    }
    const k_o = handle.state?.k_o ?? 0;
    if (this.paperPending && handle.state?.phase === "joined" && k_o > 0 && norm(handle.state.force) > 0) {
      this.paperPending = false;
      handle.setLaw("proportional", { k_h: PAPER * k_o, integral_gain: 0 });
    }
  }

  /** Put the finger at a place; `free_way` is a direction in which nothing blocks the way off the object. */
  private put({ place }: Met, free_way: Vec3): void {
    [this.over, this.free_way, this.leaving] = [place, free_way, false];
  }

  /** Keep a finger that does not press off the surface: when others let the surface come back, the finger gives way. */
  private clear(finger: Finger): Finger {
    if (finger.pressing || this.over === null) return finger;
    return { ...finger, offset: Math.max(finger.offset, this.shape?.height(this.over) ?? 0) };
  }

  private meet(origin: Vec3, direction: Vec3): Met | null {
    return this.shape?.meet(origin, direction) ?? null;
  }
}
