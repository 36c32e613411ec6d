/** The visitor's hand: in the room or not, its target position, and the law it presses with. */

import type { RestMesh } from "../model/body";
import type { HandSettings, TouchHandle, TouchSettings, TouchState } from "../model/hand";
import { type LawName, PAPER } from "../model/laws";
import type { SceneSnapshot, WatchInfo } from "../model/scene";
import { along, norm, sub, unit, type Vec3 } from "../model/vec";
import type { LawChoice } from "../ui/dock";
import { vertexNormals } from "../view/body/normals";
import { deeper, type Finger, follow, goal, hover, type Place3, press, release, slide } from "../view/pointing/finger";
import { at, pick, type Place, placeTowards } from "../view/pointing/pick";

/** A hand as people have one, and one that is held still, like the clamp of the paper's figures. */
export const HANDS: Readonly<Record<"natural" | "firm", HandSettings>> = {
  natural: { mass: 0.15, damping: 8, stiffness: 400 },
  firm: { mass: 0.15, damping: 60, stiffness: 10_000 },
};
const MAX_FORCE = 10; // N
const AWAY = 1.3; // radii of the body, where a hand appears

/** @param beside Another hand than the visitor's own. */
export type StartTouch = (settings: TouchSettings, beside?: boolean) => TouchHandle;

export class OwnHand {
  handle: TouchHandle | null = null;
  /** Last word of a hand that the server ended; null while there is none. */
  ended: TouchState | null = null;
  /** The chosen law; the law in use follows with the next patches. */
  law: LawChoice = "predictive";
  /** mu of the finger. */
  friction = 0;
  private readonly startTouch: StartTouch;
  private mesh: RestMesh | null = null;
  private normals: Float32Array = new Float32Array(0);
  private info: WatchInfo | null = null;
  private positions: Float32Array | null = null;
  private finger: Finger | null = null;
  private tip: Vec3 = [0, 0, 0];
  private grip: "natural" | "firm" = "natural";
  private paperPending = false;
  private guided: Vec3 | null = null;
  /** A press that waits until the hand is in the room and free. */
  private pending: Place3 | null = null;

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

  /** One line about the next step; empty when it is obvious. */
  hint(): string {
    const state = this.state;
    if (this.handle === null) return "";
    if (state?.place) return `The room is full. You wait for a place: place ${state.place[0]} of ${state.place[1]}.`;
    if (state === null || (state.phase === "connecting" && state.user === 0)) return "Joining the room\u2026";
    if (state.phase === "connecting") return "Your hand waits for the server to come back.";
    if (state.fault !== "") return `Force off: ${state.fault}.`;
    if (state.doing === "touching" || this.pressing) return "";
    return "Press on the object and hold; drag to slide, wheel or Shift for depth.";
  }

  setBody(mesh: RestMesh | null, info: WatchInfo | null): void {
    this.info = info;
    if (mesh === null || mesh === this.mesh) return;
    const another = this.mesh !== null && !sameShape(mesh, this.mesh);
    this.mesh = mesh;
    this.normals = vertexNormals(mesh.vertices, mesh.faces);
    this.positions = null;
    this.finger = null;
    if (another && info !== null) this.standOff(info.body);
  }

  /** Where the hand was, the new object may be: it waits outside, from where it can be engaged. */
  private standOff({ center, radius }: WatchInfo["body"]): void {
    const away = sub(this.tip, center);
    this.tip = along(center, AWAY * radius, norm(away) > 0 ? unit(away) : [0, -1, 0]);
    this.paperPending = this.law === "paper"; // its gains were those of the object before
    this.handle?.point(this.tip);
  }

  /**
   * @param towards From the middle of the body to where the hand appears.
   * @param wait For a seat, where the room is full.
   */
  start(url: string, name: string, towards: Vec3, wait = false): void {
    if (this.handle !== null || this.info === null) return;
    this.ended = null;
    const { center, radius } = this.info.body;
    this.tip = along(center, AWAY * radius, unit(towards));
    this.handle = this.startTouch({
      url, name, law: this.law === "paper" ? "proportional" : this.law, geometry: "sphere",
      max_force: MAX_FORCE, friction: this.friction, passivity: true, hand: HANDS[this.grip], target: this.tip, wait,
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

  /** Seat, force and place in the queue stay. */
  rename(name: string): void {
    this.handle?.setName(name);
  }

  setFriction(mu: number): void {
    this.friction = mu;
    this.handle?.setFriction(mu);
  }

  /** Hold the tip as people do, or as a clamp does. */
  hold(grip: "natural" | "firm"): void {
    this.grip = grip;
    this.handle?.setHand(HANDS[grip]);
  }

  /** Take hold of the surface where a ray meets it. */
  press(origin: Vec3, direction: Vec3, now: number): boolean {
    const place = this.meet(origin, direction);
    if (this.handle === null || place === null) return false;
    this.guided = null;
    if (!this.free) {
      this.pending = place;
      return true;
    }
    this.finger = press(place, now, this.finger?.depth);
    return true;
  }

  slide(origin: Vec3, direction: Vec3): void {
    const place = this.meet(origin, direction);
    if (place !== null && this.pending !== null) this.pending = place;
    else if (place !== null && this.finger !== null) this.finger = slide(this.finger, place);
  }

  hover(origin: Vec3, direction: Vec3): void {
    if (this.handle === null || this.pressing) return;
    const place = this.meet(origin, direction);
    if (place !== null) this.finger = hover(place, this.finger?.depth);
  }

  /** Whether a ray meets the object. */
  meets(origin: Vec3, direction: Vec3): boolean {
    return this.meet(origin, direction) !== null;
  }

  /** In the room, and let go of what was there before: from then on it may press. */
  private get free(): boolean {
    const state = this.state;
    return state?.phase === "joined" && state.doing !== "waiting" && state.doing !== "connecting";
  }

  release(): void {
    this.pending = null;
    if (this.finger !== null) this.finger = release(this.finger);
  }

  /** In radii of the body. */
  deeper(by: number): void {
    if (this.finger !== null) this.finger = deeper(this.finger, by);
  }

  depth(depth: number): void {
    if (this.finger !== null) this.finger = { ...this.finger, depth };
  }

  /** Press where the body looks in a direction, as a guide does who takes one's hand. */
  guide(direction: Vec3, depth: number, now: number): void {
    if (this.mesh === null || this.info === null) return;
    const { center, radius } = this.info.body;
    // ContactForce again, the own dent would count as the surface.
    if (this.finger?.pressing === true && this.guided === direction) {
      this.depth(depth);
      return;
    }
    this.guided = direction;
    const hit = placeTowards(this.mesh.vertices, this.mesh.faces, center, unit(direction), radius);
    if (hit !== null) this.finger = press(this.place(hit), now, depth);
  }

  /** Move on to `now`; the loop is told where the hand wants to be. */
  step(view: SceneSnapshot | null, now: number, dt: number): void {
    if (view !== null) this.positions = view.positions;
    const { handle, info } = this;
    if (handle === null || info === null) return;
    if (this.pending !== null && this.free) {
      this.finger = press(this.pending, now, this.finger?.depth);
      this.pending = null;
    }
    if (this.finger !== null) {
      const { center, radius } = info.body;
      const before = this.tip;
      this.tip = follow(this.tip, goal(this.finger, now, radius), center, radius, Math.min(dt, 0.1));
      if (this.tip !== before) handle.point(this.tip);
    }
    const k_o = handle.state?.k_o ?? 0;
    if (this.paperPending && handle.state?.phase === "joined" && k_o > 0 && norm(handle.state.force) > 0) {
      this.paperPending = false;
      handle.setLaw("proportional", { k_h: PAPER * k_o, integral_gain: 0 });
    }
  }

  private meet(origin: Vec3, direction: Vec3): Place3 | null {
    if (this.mesh === null) return null;
    const hit = pick(this.positions ?? this.mesh.vertices, this.mesh.faces, origin, direction);
    return hit === null ? null : this.place(hit);
  }

  private place(place: Place): Place3 {
    const mesh = this.mesh;
    if (mesh === null) return { surface: [0, 0, 0], normal: [0, 0, 1], point: [0, 0, 0] };
    const surface = at(mesh.vertices, mesh.faces, place);
    return {
      surface,
      normal: unit(at(this.normals, mesh.faces, place)),
      point: at(this.positions ?? mesh.vertices, mesh.faces, place),
    };
  }
}

/** Whether it is the object of before: a page that comes in again reads its mesh anew. */
function sameShape(a: RestMesh, b: RestMesh): boolean {
  return a.vertices.length === b.vertices.length && a.vertices.every((x, i) => x === b.vertices[i]);
}
