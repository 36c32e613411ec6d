/** A simulated partner, which the tour or the visitor brings where nobody else is: another hand of this page, which presses and holds still. */

import type { TouchHandle } from "../model/hand";
import type { RestMesh } from "../model/body";
import { DEFAULT_LAW } from "../model/laws";
import { FULL_FORCE } from "../model/scale";
import type { WatchInfo } from "../model/scene";
import { along, unit, type Vec3 } from "../model/vec";
import { ROOM_FULL } from "../protocol/close_codes";
import { vertexNormals } from "../view/body/normals";
import { at, placeTowards } from "../view/pointing/pick";
import { HANDS, type StartTouch } from "./own_hand";

const NAME = "simulated partner"; // for everybody who is there
const AWAY = 1.3; // radii of the body, from where it comes
const DEPTH = 0.12; // radii that it presses
const ROUND = 2.8; // rad from the tour's hand: nearly opposite, where what one presses in comes out, and still in sight of who looks from beside

/**
 * Where a partner presses, seen from the middle of the body, for a visitor who presses in a direction.
 *
 * @param round How far from there [rad].
 */
export function besides([x, y, z]: Vec3, round = ROUND): Vec3 {
  const [c, s] = [Math.cos(round), Math.sin(round)];
  return unit([c * x - s * y, s * x + c * y, z]);
}

export class Partner {
  /** Its hand, here or on the way in; null for none. */
  handle: TouchHandle | null = null;
  /** Why it is not here, or not any more; empty for no reason. */
  why = "";
  private goal: Vec3 | null = null;

  constructor(private readonly startTouch: StartTouch) {}

  /**
   * @param towards From the middle of the body.
   * @returns Whether there is a place to press.
   */
  come(url: string, names: readonly string[], mesh: RestMesh, info: WatchInfo, towards: Vec3): boolean {
    if (this.handle !== null) return true;
    this.why = "";
    const { center, radius } = info.body;
    const place = placeTowards(mesh.vertices, mesh.faces, center, unit(towards), radius);
    if (place === null) return false;
    const normal = unit(at(vertexNormals(mesh.vertices, mesh.faces), mesh.faces, place));
    this.goal = along(at(mesh.vertices, mesh.faces, place), -DEPTH * radius, normal);
    this.handle = this.startTouch({
      url, name: freeName(names), law: DEFAULT_LAW, geometry: "sphere", max_force: FULL_FORCE, friction: 0, passivity: true,
      hand: HANDS.firm, target: along(center, AWAY * radius, unit(towards)),
    }, true);
    return true;
  }

  /** A picture is drawn: somebody may look, as with the visitor's own hand, and it presses once it may. */
  frame(): void {
    const { handle, goal } = this;
    handle?.alive();
    const state = handle?.state ?? null;
    if (handle === null || goal === null || state?.phase !== "joined" || state.doing === "waiting" || state.doing === "connecting") return;
    handle.point(goal);
    this.goal = null;
  }

  /** Whether it is still here. */
  update(): void {
    const { state = null, failure = "" } = this.handle ?? {};
    if (failure !== "" || state?.phase === "closed") {
      this.leave();
      this.why = state?.code === ROOM_FULL ? "the room is full: it has no place for one more hand" : failure || (state?.reason ?? "");
    }
  }

  leave(): void {
    void this.handle?.close();
    this.handle = null;
    this.goal = null;
  }
}

/** A name that nobody in the room has, nor the visitor; servers do not tell names apart by their case. */
export function freeName(taken: readonly string[]): string {
  const known = taken.map((name) => name.toLowerCase());
  for (let n = 1; ; n++) {
    const name = n === 1 ? NAME : `${NAME} ${n}`;
    if (!known.includes(name)) return name;
  }
}
