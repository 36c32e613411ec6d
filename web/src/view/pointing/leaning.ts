/** The camera on its way off the normal of what is pressed, and back; loaded with the first press. */

import { type PerspectiveCamera, Quaternion, Vector3 } from "three";
import { norm, sub, unit, type Vec3 } from "../../model/vec";
import type { Place3 } from "./finger";
import { axisOf, type Lean, leaning, leanOff } from "./lean";

const SEEN = 0.1; // radii of the body by which a place that is looked at may be off

/** The visitor's hand, as far as the camera goes by it. */
interface Presser {
  /** What the press has taken hold of; null while there is none. */
  readonly held: Place3 | null;
  /** Point of the resting surface that a ray meets. */
  placeAt(origin: Vec3, direction: Vec3): Vec3 | null;
}

export class Leaning {
  /** Off the camera that does not lean [rad]. */
  angle = 0;
  private lean: Lean | null = null;
  private presser: Presser | null = null;

  /** Lean for the press of now until it ends, where a dent is seen better so. */
  hold(presser: Presser, straight: PerspectiveCamera, radius: number): void {
    const { held } = presser;
    if (held === null) return;
    const sees = (eye: Vec3): boolean => {
      const place = presser.placeAt(eye, unit(sub(held.point, eye)));
      return place !== null && norm(sub(place, held.surface)) < SEEN * radius;
    };
    const sight = { eye: straight.position.toArray(), right: rightOf(straight).toArray(), aspect: straight.aspect };
    const lean = leanOff(held.point, held.normal, sight, sees);
    if (lean === null) return;
    // On the way back from another press it goes on about that one's place: the picture does not jump.
    if (this.angle === 0) this.lean = lean;
    this.presser = presser;
  }

  /** @returns Whether the picture changes. */
  step(dt: number): boolean {
    const { angle } = this;
    const pressed = this.presser?.held != null;
    if (!pressed) this.presser = null; // the next press says so itself
    this.angle = leaning(angle, pressed ? (this.lean?.angle ?? 0) : 0, dt);
    return this.angle !== angle;
  }

  /** Turn the camera, which stands as `straight` does. */
  apply(camera: PerspectiveCamera, straight: PerspectiveCamera): void {
    if (this.lean === null || this.angle === 0) return;
    const pivot = new Vector3(...this.lean.pivot);
    const axis = new Vector3(...axisOf(this.lean.way, rightOf(straight).toArray()));
    camera.position.sub(pivot).applyAxisAngle(axis, this.angle).add(pivot);
    camera.quaternion.premultiply(new Quaternion().setFromAxisAngle(axis, this.angle));
    camera.updateMatrixWorld();
  }
}

function rightOf(camera: PerspectiveCamera): Vector3 {
  return new Vector3().setFromMatrixColumn(camera.matrixWorld, 0);
}
