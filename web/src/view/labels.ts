/** Names at the ends of the stems: text over the canvas, placed by the object model and not by markup. */

import { norm, type Vec3 } from "../model/vec";
import { LEAST_FORCE, type Pose } from "./pose";

interface Label {
  readonly box: HTMLElement;
  readonly name: HTMLElement;
  readonly force: HTMLElement;
  width: number;
}

interface Pixel {
  readonly x: number;
  readonly y: number;
}

const CLEAR = 46; // px over a hand whose stem points at the eye
const TALL = 12; // px, half the height of a name

/**
 * Middle of a name so that it begins where the stem ends and covers neither stem nor arrow.
 *
 * @param tip Of the hand, and `end` of its stem [px].
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

export class Labels {
  private readonly host: HTMLElement;
  private readonly labels = new Map<number, Label>();
  private readonly colour: (user: number) => string;

  constructor(host: HTMLElement, colour: (user: number) => string) {
    this.host = host;
    this.colour = colour;
  }

  /**
   * @param anchor Where a user's name belongs, world frame.
   * @param project From there to pixels.
   */
  place(
    poses: readonly Pose[],
    anchor: (user: number) => Vec3 | null,
    project: (point: Vec3) => { x: number; y: number } | null,
  ): void {
    const present = new Set(poses.map((pose) => pose.user));
    for (const [user, label] of this.labels) {
      if (present.has(user)) continue;
      label.box.remove();
      this.labels.delete(user);
    }
    for (const pose of poses) {
      const label = this.labels.get(pose.user) ?? this.make(pose.user);
      const words = pose.own ? `${pose.name} (you)` : pose.name;
      if (label.name.textContent !== words) {
        label.name.textContent = words;
        label.width = label.box.offsetWidth;
      }
      const f = norm(pose.force);
      const text = f > LEAST_FORCE ? `${f.toFixed(2)} N` : "";
      if (label.force.textContent !== text) {
        label.force.textContent = text;
        label.width = label.box.offsetWidth;
      }
      const end = anchor(pose.user);
      const pixel = end === null ? null : project(end);
      label.box.classList.toggle("gone", pixel === null || pose.presence < 0.02);
      if (pixel === null) continue;
      const half = 0.5 * label.width;
      const middle = beside(project(pose.proxy) ?? pixel, pixel, half);
      // Kept inside the picture, so that a phone shows the names too.
      const x = Math.min(this.host.clientWidth - half - 6, Math.max(half + 6, middle.x));
      const y = Math.min(this.host.clientHeight - 20, Math.max(20, middle.y));
      label.box.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px) translate(-50%, -50%)`;
      label.box.style.opacity = pose.presence.toFixed(2);
    }
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
    const label = { box, name, force, width: 80 };
    this.labels.set(user, label);
    return label;
  }
}
