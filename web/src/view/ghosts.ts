/** Outlined tips beside the drawn tips: the second position of each hand, which differs by the hand's delay. */

import { CylinderGeometry, Group, Mesh, MeshBasicMaterial, Quaternion, SphereGeometry, TorusGeometry, Vector3 } from "three";
import { along, norm, sub, type Vec3 } from "../model/vec";
import type { Stage } from "./stage";

export interface Outline {
  readonly user: number;
  /** Position of the outlined tip; `from` is that of the drawn tip [m]. */
  readonly at: Vec3;
  readonly from: Vec3;
  readonly normal: Vec3;
}

const TIP = 0.045; // radii of the body, the size of a hand's tip
const UP = new Vector3(0, 1, 0);

class Bubble {
  readonly group = new Group();
  private readonly flat: MeshBasicMaterial;
  private readonly edge: MeshBasicMaterial;
  private readonly ring: Mesh;
  private readonly ball: Mesh;
  private readonly thread: Mesh;

  constructor(private readonly radius: number) {
    this.flat = new MeshBasicMaterial({ transparent: true, opacity: 0.22, depthTest: false });
    this.edge = new MeshBasicMaterial({ transparent: true, opacity: 0.95, depthTest: false });
    this.ball = new Mesh(new SphereGeometry(1.25 * TIP * radius, 24, 16), this.flat);
    this.ring = new Mesh(new TorusGeometry(1.3 * TIP * radius, 0.009 * radius, 8, 40), this.edge);
    this.thread = new Mesh(new CylinderGeometry(0.008 * radius, 0.008 * radius, 1, 6), this.edge);
    this.ring.renderOrder = this.ball.renderOrder = this.thread.renderOrder = 4;
    this.group.add(this.ball, this.ring, this.thread);
  }

  place({ at, from, normal }: Outline, colour: string, towards: Quaternion): void {
    this.flat.color.set(colour);
    this.edge.color.set(colour);
    const lift = TIP * this.radius;
    const [here, there] = [along(at, lift, normal), along(from, lift, normal)];
    this.ball.position.set(...here);
    this.ring.position.set(...here);
    this.ring.quaternion.copy(towards);
    const way = sub(there, here);
    const apart = norm(way);
    this.thread.visible = apart > 0.01 * this.radius;
    if (!this.thread.visible) return;
    this.thread.position.set(...along(here, 0.5, way));
    this.thread.quaternion.setFromUnitVectors(UP, new Vector3(...way).divideScalar(apart));
    this.thread.scale.set(1, apart, 1);
  }

  dispose(): void {
    for (const part of [this.ball, this.ring, this.thread]) part.geometry.dispose();
    this.flat.dispose();
    this.edge.dispose();
  }
}

/** The outlines on a stage, which may change or be missing after the graphics were lost. */
export class Outlines {
  private stage: Stage | null = null;
  private radius = 0;
  private readonly group = new Group();
  private readonly bubbles = new Map<number, Bubble>();
  private shown = "";

  /** @param radius Radius of the body [m]. */
  draw(stage: Stage | null, outlines: readonly Outline[], radius: number, colour: (user: number) => string): void {
    if (stage !== this.stage || radius !== this.radius) this.clear();
    [this.stage, this.radius] = [stage, radius];
    if (stage === null) return;
    // Outlines at rest need no new picture; turns of the camera draw one by themselves.
    const key = JSON.stringify(outlines.map(({ user, at, from }) => [user, ...at, ...from].map((x) => Math.round(1e5 * x))));
    for (const [user, bubble] of this.bubbles) {
      if (outlines.some((one) => one.user === user)) continue;
      this.group.remove(bubble.group);
      bubble.dispose();
      this.bubbles.delete(user);
    }
    for (const outline of outlines) {
      let bubble = this.bubbles.get(outline.user);
      if (bubble === undefined) {
        bubble = new Bubble(radius);
        this.bubbles.set(outline.user, bubble);
        this.group.add(bubble.group);
      }
      bubble.place(outline, colour(outline.user), stage.camera.quaternion);
    }
    if (this.group.parent === null && outlines.length > 0) stage.scene.add(this.group);
    if (key !== this.shown) stage.touch();
    this.shown = key;
  }

  private clear(): void {
    for (const bubble of this.bubbles.values()) {
      this.group.remove(bubble.group);
      bubble.dispose();
    }
    this.bubbles.clear();
    this.group.removeFromParent();
    this.stage?.touch();
    this.shown = "";
  }
}
