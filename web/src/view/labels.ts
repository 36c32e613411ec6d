/** Names at the ends of the stems: text over the canvas, made by DOM calls and not as markup. */

import { norm, type Vec3 } from "../model/vec";
import { LEAST_FORCE, type Pose } from "./pose";

interface Label {
  readonly box: HTMLElement;
  readonly name: HTMLElement;
  readonly force: HTMLElement;
  width: number;
  /** Shift of the name, up or down, from its own place [px]; null if there is no room for it. */
  off: number | null;
}

interface Pixel {
  readonly x: number;
  readonly y: number;
}

const CLEAR = 46; // px; height of a name over a hand whose stem points at the eye
const TALL = 12; // px, half the height of a name
const OFF = 20; // px; largest distance of the dock from the foot of the stage
const APART = 26; // px from the middle of a name to the middle of the name below it
const STEPS = [0, 1, -1, 2, -2, 3, -3]; // shifts of a name, in heights of names; a name that is farther off would seem to belong to nobody
const SLACK = 6; // px of extra room before a name returns to its own place, so that it does not jump to and fro

/**
 * Middle of a name so that it begins where the stem ends and covers neither stem nor arrow.
 *
 * @param tip Tip of the hand; `end` is the end of its stem [px].
 * @param half Half the width of the name [px].
 */
export function beside(tip: Pixel, end: Pixel, half: number): Pixel {
  const dx = end.x - tip.x;
  const dy = end.y - tip.y;
  const length = Math.hypot(dx, dy);
  if (length < CLEAR) return { x: end.x, y: Math.min(tip.y, end.y) - CLEAR };
  // Along the stem until its end lies on the edge of the name's box.
  const reach = Math.min(half / Math.max(1e-6, Math.abs(dx / length)), TALL / Math.max(1e-6, Math.abs(dy / length)));
  return { x: end.x + (reach * dx) / length, y: end.y + (reach * dy) / length };
}

/** A name on the picture. */
export interface Place extends Pixel {
  /** Half the width of the name [px]. */
  readonly half: number;
  /** Present shift of the name [px]; null if the name is left out. */
  readonly off: number | null;
}

/**
 * Shift of each name, up or down, so that no name covers another; null for a name without room.
 *
 * @param places Names in the order in which they may choose a place.
 * @param low Upper and, as `high`, lower limit of the middles of names [px].
 */
export function arranged(places: readonly Place[], low: number, high: number): (number | null)[] {
  const taken: { x: number; y: number; half: number }[] = [];
  return places.map(({ x, y, half, off }) => {
    const free = (by: number, slack: number): boolean => y + by >= low && y + by <= high && taken.every((other) =>
      Math.abs(other.x - x) >= other.half + half + slack || Math.abs(other.y - y - by) >= APART - 2 + slack);
    const found = off !== 0 && free(0, SLACK) ? 0 : off !== null && free(off, 0) ? off : STEPS.map((step) => APART * step).find((by) => free(by, 0));
    if (found === undefined) return null;
    taken.push({ x, y: y + found, half });
    return found;
  });
}

export class Labels {
  private readonly host: HTMLElement;
  private readonly labels = new Map<number, Label>();
  private readonly colour: (user: number) => string;

  constructor(host: HTMLElement, colour: (user: number) => string) {
    this.host = host;
    this.colour = colour;
  }

  /**
   * @param anchor Returns the place of a user's name, world frame.
   * @param project Converts a place to pixels.
   * @param clear Heights that are covered at the top and at the foot of the picture [px].
   */
  place(
    poses: readonly Pose[],
    anchor: (user: number) => Vec3 | null,
    project: (point: Vec3) => { x: number; y: number } | null,
    clear: readonly [number, number] = [0, 0],
  ): void {
    const present = new Set(poses.map((pose) => pose.user));
    for (const [user, label] of this.labels) {
      if (present.has(user)) continue;
      label.box.remove();
      this.labels.delete(user);
    }
    const places: (Place & { readonly label: Label; readonly pose: Pose })[] = [];
    const low = clear[0] + TALL + 4;
    const high = Math.max(low, this.host.clientHeight - clear[1] - OFF - TALL - 4);
    // The own name has its place first, then the others in the order in which their users came.
    const ordered = [...poses].sort((a, b) => Number(b.own) - Number(a.own) || a.user - b.user);
    // All names are written before one is measured; otherwise each measurement would compute the layout again.
    const written = ordered.map((pose) => write(this.labels.get(pose.user) ?? this.make(pose.user), pose));
    for (const [i, pose] of ordered.entries()) {
      const label = this.labels.get(pose.user);
      if (label === undefined) continue;
      if (written[i] === true) label.width = label.box.offsetWidth;
      const end = anchor(pose.user);
      const pixel = end === null ? null : project(end);
      const gone = pixel === null || pose.presence < 0.02;
      label.box.classList.toggle("gone", gone);
      if (gone) continue;
      const half = 0.5 * label.width;
      const middle = beside(project(pose.proxy) ?? pixel, pixel, half);
      // Names are kept inside the picture, so that a phone shows them, too.
      const x = Math.min(this.host.clientWidth - half - 6, Math.max(half + 6, middle.x));
      places.push({ x, y: Math.min(high, Math.max(low, middle.y)), half, off: label.off, label, pose });
    }
    arranged(places, low, high).forEach((off, i) => {
      const place = places[i];
      if (place === undefined) return;
      const { label, pose, x, y } = place;
      label.off = off;
      label.box.classList.toggle("crowded", off === null);
      label.box.style.transform = `translate(${x.toFixed(1)}px, ${(y + (off ?? 0)).toFixed(1)}px) translate(-50%, -50%)`;
      label.box.style.opacity = pose.presence.toFixed(2);
    });
  }

  repaint(): void {
    for (const [user, label] of this.labels) label.box.style.setProperty("--user", this.colour(user));
  }

  private make(user: number): Label {
    const box = document.createElement("div");
    box.className = "label";
    box.style.setProperty("--user", this.colour(user));
    const name = document.createElement("span");
    name.className = "label-name";
    const force = document.createElement("span");
    force.className = "label-force";
    box.append(name, force);
    this.host.append(box);
    const label = { box, name, force, width: 80, off: 0 };
    this.labels.set(user, label);
    return label;
  }
}

/** Write the words of a label. @returns Whether they have changed. */
function write(label: Label, pose: Pose): boolean {
  const words = pose.own ? `${pose.name} (you)` : pose.name;
  const f = norm(pose.force);
  const text = f > LEAST_FORCE ? `${f.toFixed(2)} N` : "";
  if (label.name.textContent === words && label.force.textContent === text) return false;
  label.name.textContent = words;
  label.force.textContent = text;
  return true;
}
