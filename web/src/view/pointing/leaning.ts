/** Motion of the camera off the normal of the pressed place, and back; loaded with the first press. */

import { type PerspectiveCamera, Quaternion, Vector3 } from "three";
import { norm, sub, unit, type Vec3 } from "../../model/vec";
import type { Place3 } from "./finger";
import { axisOf, type Lean, leaning, leanOff } from "./lean";

const SEEN = 0.1; // radii of the body; tolerance between the pressed point and the place that the eye sees

/** The facts on the visitor's hand that the camera uses. */
interface Presser {
  /** Place that the press has grasped; null without a press. */
  readonly held: Place3 | null;
  /** Point of the resting surface that a ray meets. */
  placeAt(origin: Vec3, direction: Vec3): Vec3 | null;
}

export class Leaning {
  /** Present angle from the camera that does not lean [rad]. */
  angle = 0;
  private lean: Lean | null = null;
  private presser: Presser | null = null;

  /** Lean until the present press ends, if that makes a dent more visible. */
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
    // On the way back from another press the camera keeps that press's pivot, so that the picture does not jump.
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

  /** Turn the camera, which begins at the position of `straight`. */
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
