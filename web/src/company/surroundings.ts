/** The parts of the page that company needs. */

import type { TouchState } from "../model/hand";
import type { SceneSnapshot, SceneStore } from "../model/scene";
import type { Vec3 } from "../model/vec";
import type { Orbit } from "../view/orbit";

export interface Surroundings {
  store(): SceneStore;
  /** What is seen of now; null while a time of before is, or the server is silent. */
  view(): SceneSnapshot | null;
  colour(user: number): string;
  /** Null without graphics. */
  stage(): { readonly target: Orbit; goTo(orbit: Orbit): void } | null;
  readonly own: {
    readonly state: TouchState | null;
    /** The point of the resting surface that a ray meets; null beside it. */
    placeAt(origin: Vec3, direction: Vec3): Vec3 | null;
  };
  /** By which the visitor goes. */
  name(): string;
  /** Politely, to those who do not see the page. */
  speak(words: string): void;
  /** With which the own hand says that it is this page's. */
  readonly key: string;
}
