/** The parts of the page that company needs. */

import type { TouchState } from "../model/hand";
import type { SceneSnapshot, SceneStore } from "../model/scene";
import type { Vec3 } from "../model/vec";
import type { Orbit } from "../view/orbit";

export interface Surroundings {
  readonly store: SceneStore;
  /** The present scene; null while a past time is shown or the server is silent. */
  readonly present: SceneSnapshot | null;
  colour(user: number): string;
  /** The stage; null without graphics. */
  readonly stage: { readonly target: Orbit; goTo(orbit: Orbit): void } | null;
  readonly own: {
    readonly state: TouchState | null;
    /** The point of the resting surface that a ray meets; null beside it. */
    placeAt(origin: Vec3, direction: Vec3): Vec3 | null;
  };
  readonly visitor: { readonly name: string };
  /** Have a screen reader speak the words, without an interruption. */
  speak(words: string): void;
  /** `key` is the secret by which the own hand proves that it belongs to this page. */
  readonly settings: { readonly key: string };
}
