/** A simulated partner that the tour brings where nobody else is: another hand of this page, which presses and holds still. */

import type { TouchHandle } from "../model/hand";
import type { RestMesh } from "../model/body";
import { FULL_FORCE } from "../model/scale";
import type { WatchInfo } from "../model/scene";
import { along, unit, type Vec3 } from "../model/vec";
import { vertexNormals } from "../view/body/normals";
import { at, placeTowards } from "../view/pointing/pick";
import { HANDS, type StartTouch } from "./own_hand";

const AWAY = 1.3; // radii of the body, from where it comes
const DEPTH = 0.12; // radii that it presses
const ROUND = 2.8; // rad from the visitor's hand: nearly opposite, where what one presses in comes out, and still in sight

/** Where a partner presses, seen from the middle of the body, for a visitor who presses in a direction. */
export function besides([x, y, z]: Vec3): Vec3 {
  const [c, s] = [Math.cos(ROUND), Math.sin(ROUND)];
  return unit([c * x - s * y, s * x + c * y, z]);
}

export class Partner {
  /** Its hand, here or on the way in; null for none. */
  handle: TouchHandle | null = null;
  private goal: Vec3 | null = null;

  constructor(private readonly startTouch: StartTouch) {}

  /** @param towards From the middle of the body. */
  come(url: string, names: readonly string[], mesh: RestMesh, info: WatchInfo, towards: Vec3): void {
    if (this.handle !== null) return;
    const { center, radius } = info.body;
    const place = placeTowards(mesh.vertices, mesh.faces, center, unit(towards), radius);
    if (place === null) return;
    const normal = unit(at(vertexNormals(mesh.vertices, mesh.faces), mesh.faces, place));
    this.goal = along(at(mesh.vertices, mesh.faces, place), -DEPTH * radius, normal);
    this.handle = this.startTouch({
      url, name: freeName(names), law: "predictive", geometry: "sphere", max_force: FULL_FORCE, friction: 0, passivity: true,
      hand: HANDS.firm, target: along(center, AWAY * radius, unit(towards)),
    }, true);
  }

  /** Presses once it may. */
  update(): void {
    this.handle?.alive();
    const state = this.handle?.state;
    if (this.handle === null || state === null || state === undefined) return;
    if (state.phase === "closed") {
      this.leave();
      return;
    }
    if (this.goal === null || state.phase !== "joined" || state.doing === "waiting" || state.doing === "connecting") return;
    this.handle.point(this.goal);
    this.goal = null;
  }

  leave(): void {
    void this.handle?.close();
    this.handle = null;
    this.goal = null;
  }
}

/** A name that nobody in the room has. */
export function freeName(taken: readonly string[]): string {
  for (let n = 1; ; n++) {
    const name = n === 1 ? "partner" : `partner ${n}`;
    if (!taken.includes(name)) return name;
  }
}
