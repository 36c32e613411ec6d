/** Hands in the scene: a tip on the surface, a stem that leads to the name, the force along it, the patch it holds. */

import {
  BufferAttribute,
  CircleGeometry,
  ConeGeometry,
  CylinderGeometry,
  DoubleSide,
  Group,
  Mesh,
  MeshBasicMaterial,
  MeshStandardMaterial,
  Quaternion,
  RingGeometry,
  SphereGeometry,
  Vector3,
  type BufferGeometry,
  type Material,
  type Object3D,
} from "three";
import { along, norm, unit, type Vec3 } from "../model/vec";
import { LEAST_FORCE, type Pose } from "./pose";

/** Length of an arrow for one newton, in radii of the body. */
export const ARROW_PER_NEWTON = 0.12;
const LONGEST_ARROW = 1.4;
const STEM = 0.42;

const UP = new Vector3(0, 1, 0);
const OUT = new Vector3(0, 0, 1);

/** One hand; lengths are made for a body of radius 1 and scaled. */
class Hand {
  readonly group = new Group();
  readonly anchor = new Vector3();
  private readonly tip: Mesh;
  private readonly stem: Mesh;
  private readonly shaft: Mesh;
  private readonly head: Mesh;
  private readonly probe: Mesh;
  private readonly thread: Mesh;
  private readonly disc: Mesh<BufferGeometry, MeshBasicMaterial>;
  private readonly rim: Mesh<BufferGeometry, MeshBasicMaterial>;
  private readonly materials: Material[];
  private readonly radius: number;
  private bend = Number.NaN;
  private readonly solid: MeshStandardMaterial;
  private readonly flat: MeshBasicMaterial;

  constructor(radius: number, patchRadius: number) {
    this.radius = radius;
    this.solid = new MeshStandardMaterial({ roughness: 0.35, metalness: 0 });
    this.flat = new MeshBasicMaterial({ transparent: true, opacity: 0.55 });
    const inside = new MeshBasicMaterial({ transparent: true, opacity: 0.85, depthTest: false });
    const sheet = new MeshBasicMaterial({ transparent: true, opacity: 0.16, side: DoubleSide, depthWrite: false });
    const edge = new MeshBasicMaterial({ transparent: true, opacity: 0.7, side: DoubleSide, depthWrite: false });
    this.materials = [this.solid, this.flat, inside, sheet, edge];
    this.tip = new Mesh(new SphereGeometry(0.045 * radius, 24, 16), this.solid);
    this.stem = new Mesh(new CylinderGeometry(0.006 * radius, 0.006 * radius, 1, 8), this.flat);
    this.shaft = new Mesh(new CylinderGeometry(0.02 * radius, 0.02 * radius, 1, 16), this.solid);
    this.head = new Mesh(new ConeGeometry(0.055 * radius, 0.13 * radius, 24), this.solid);
    this.probe = new Mesh(new SphereGeometry(0.022 * radius, 16, 12), inside);
    this.thread = new Mesh(new CylinderGeometry(0.004 * radius, 0.004 * radius, 1, 6), inside);
    this.disc = new Mesh(new CircleGeometry(patchRadius, 40), sheet);
    this.rim = new Mesh(new RingGeometry(0.965 * patchRadius, patchRadius, 48, 1), edge);
    this.probe.renderOrder = this.thread.renderOrder = 3;
    this.disc.renderOrder = this.rim.renderOrder = 2;
    this.group.add(this.tip, this.stem, this.shaft, this.head, this.probe, this.thread, this.disc, this.rim);
  }

  paint(colour: string): void {
    for (const material of this.materials) {
      if (material instanceof MeshBasicMaterial || material instanceof MeshStandardMaterial) material.color.set(colour);
    }
  }

  pose(pose: Pose): void {
    const r = this.radius;
    const f = norm(pose.force);
    // The tip lies on the surface; where nothing is touched it is the probe.
    const tip = along(pose.proxy, 0.045 * r, pose.normal);
    this.tip.position.set(...tip);
    const way = f > LEAST_FORCE ? unit(pose.force) : pose.normal;
    const arrow = f > LEAST_FORCE ? Math.min(LONGEST_ARROW, ARROW_PER_NEWTON * f) * r : 0;
    const stem = Math.max(STEM * r, arrow + 0.2 * r);
    between(this.stem, tip, along(tip, stem, way));
    this.anchor.set(...along(tip, stem + 0.04 * r, way));
    this.shaft.visible = this.head.visible = arrow > 0;
    if (arrow > 0) {
      const end = along(tip, arrow, way);
      between(this.shaft, tip, end);
      this.head.position.set(...along(end, 0.05 * r, way));
      this.head.quaternion.setFromUnitVectors(UP, new Vector3(...way));
    }
    this.probe.position.set(...pose.probe);
    const sunk = Math.hypot(...along(pose.probe, -1, pose.proxy)) > 0.004 * r;
    this.probe.visible = sunk && f > LEAST_FORCE;
    this.thread.visible = this.probe.visible;
    if (sunk) between(this.thread, pose.probe, pose.proxy);
    this.patch(pose, f);
    this.group.visible = pose.presence > 0.02;
    this.flat.opacity = 0.55 * pose.presence;
  }

  dispose(): void {
    this.group.traverse((object: Object3D) => {
      if (object instanceof Mesh) (object as Mesh).geometry.dispose();
    });
    for (const material of this.materials) material.dispose();
  }

  private patch(pose: Pose, force: number): void {
    this.disc.visible = this.rim.visible = pose.held;
    if (!pose.held) return;
    const turn = new Quaternion().setFromUnitVectors(OUT, new Vector3(...pose.normal));
    const strength = pose.presence * (force > LEAST_FORCE ? 1 : 0.5);
    this.disc.material.opacity = 0.16 * strength;
    this.rim.material.opacity = 0.7 * strength;
    for (const part of [this.disc, this.rim]) {
      part.position.set(...along(pose.x_free, 0.004 * this.radius, pose.normal));
      part.quaternion.copy(turn);
    }
    if (Math.abs(pose.curvature - this.bend) < 0.02 * Math.abs(this.bend) + 1e-3) return;
    this.bend = pose.curvature;
    for (const part of [this.disc, this.rim]) bendDown(part.geometry.getAttribute("position") as BufferAttribute, this.bend);
  }
}

/** All hands, by user. */
export class Hands {
  readonly group = new Group();
  /** Never seen: its shaders are compiled with the body's, so that none waits for them who comes into the room. */
  private readonly model: Hand;
  private readonly hands = new Map<number, Hand>();
  private readonly radius: number;
  private readonly patchRadius: number;
  private readonly colour: (user: number) => string;

  constructor(radius: number, contactRadius: number, colour: (user: number) => string) {
    this.radius = radius;
    this.patchRadius = Math.max(1.6 * contactRadius, 0.2 * radius);
    this.colour = colour;
    this.model = new Hand(this.radius, this.patchRadius);
    this.model.group.visible = false;
    this.group.add(this.model.group);
  }

  pose(poses: readonly Pose[]): void {
    const present = new Set(poses.map((pose) => pose.user));
    for (const [user, hand] of this.hands) {
      if (present.has(user)) continue;
      this.group.remove(hand.group);
      hand.dispose();
      this.hands.delete(user);
    }
    for (const pose of poses) {
      let hand = this.hands.get(pose.user);
      if (hand === undefined) {
        hand = new Hand(this.radius, this.patchRadius);
        hand.paint(this.colour(pose.user));
        this.hands.set(pose.user, hand);
        this.group.add(hand.group);
      }
      hand.pose(pose);
    }
  }

  /** Colours depend on the ground they are seen on. */
  repaint(): void {
    for (const [user, hand] of this.hands) hand.paint(this.colour(user));
  }

  /** Where a hand's name is written, world frame [m]. */
  anchor(user: number): Vec3 | null {
    const hand = this.hands.get(user);
    return hand === undefined ? null : hand.anchor.toArray();
  }

  dispose(): void {
    this.pose([]);
    this.model.dispose();
  }
}

/** Lay a cylinder of length 1 from one point to another. */
function between(part: Mesh, from: Vec3, to: Vec3): void {
  const way = new Vector3(...to).sub(new Vector3(...from));
  const length = Math.max(way.length(), 1e-9);
  part.position.set(...from).addScaledVector(way, 0.5);
  part.quaternion.setFromUnitVectors(UP, way.divideScalar(length));
  part.scale.set(1, length, 1);
}

/** Bend a flat sheet away from +z as a sphere of this curvature does. */
function bendDown(position: BufferAttribute, curvature: number): void {
  for (let i = 0; i < position.count; i++) {
    const rr = position.getX(i) ** 2 + position.getY(i) ** 2;
    position.setZ(i, -0.5 * curvature * rr);
  }
  position.needsUpdate = true;
}
