/** Names at the ends of the stems: text over the canvas, placed by the object model and not by markup. */

import type { Vec3 } from "../types";
import { LEAST_FORCE, type Pose } from "./pose";
import { norm } from "../vec";

const CLEAR = 52; // px between a hand and its name

interface Label {
  readonly box: HTMLElement;
  readonly name: HTMLElement;
  readonly force: HTMLElement;
  width: number;
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
    const here = new Set(poses.map((pose) => pose.user));
    for (const [user, label] of this.labels) {
      if (here.has(user)) continue;
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
      const at = anchor(pose.user);
      const pixel = at === null ? null : project(at);
      label.box.classList.toggle("gone", pixel === null || pose.presence < 0.02);
      if (pixel === null) continue;
      // Kept inside the picture, so that a phone shows the names too.
      const half = 0.5 * label.width + 6;
      const x = Math.min(this.host.clientWidth - half, Math.max(half, pixel.x));
      // A stem that points at the eye is short: the name goes above the hand and leaves it in sight.
      const tip = project(pose.proxy) ?? pixel;
      const lift = Math.max(0, CLEAR - Math.hypot(pixel.x - tip.x, pixel.y - tip.y));
      const y = Math.min(this.host.clientHeight - 20, Math.max(20, pixel.y - lift));
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
