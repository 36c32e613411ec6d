/** A simulated partner for a visitor who is alone: another hand of this page, which presses and holds still. */

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

const NAME = "simulated partner"; // the name that everybody in the room sees
const AWAY = 1.3; // radii of the body from its middle, where the partner's hand appears
const DEPTH = 0.12; // radii of the body; depth of its press
const ROUND = 2.8; // rad from the tour's hand: nearly opposite, where the pressed material bulges out, and in sight from the side

/**
 * Direction, from the middle of the body, in which a partner presses for a visitor who presses in another direction.
 *
 * @param round Angle about the vertical from the visitor's direction [rad].
 */
export function besides([x, y, z]: Vec3, round = ROUND): Vec3 {
  const [c, s] = [Math.cos(round), Math.sin(round)];
  return unit([c * x - s * y, s * x + c * y, z]);
}

export class Partner {
  /** The partner's hand, in the room or joining it; null for none. */
  handle: TouchHandle | null = null;
  /** Reason why the partner did not come or has left; empty for none. */
  why = "";
  private goal: Vec3 | null = null;

  constructor(private readonly startTouch: StartTouch) {}

  /**
   * @param towards Direction from the middle of the body in which the partner presses.
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

  /** To be called for every picture: tells the hand that the page draws, and begins to press when the hand is engaged. */
  frame(): void {
    const { handle, goal } = this;
    handle?.alive();
    const state = handle?.state ?? null;
    if (handle === null || goal === null || state?.phase !== "joined" || state.doing === "waiting" || state.doing === "connecting") return;
    handle.point(goal);
    this.goal = null;
  }

  /** Check whether the hand is still in the room; if not, keep the reason. */
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

/** A name for the partner that is not among `taken`, whatever the case of the letters, which servers ignore. */
export function freeName(taken: readonly string[]): string {
  const known = taken.map((name) => name.toLowerCase());
  for (let n = 1; ; n++) {
    const name = n === 1 ? NAME : `${NAME} ${n}`;
    if (!known.includes(name)) return name;
  }
}
