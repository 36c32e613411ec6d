/** Hands in the scene: a tip on the surface, a stem to the name, the force as arrow and ring, and the hand's local surface. */

import {
  BufferAttribute,
  type Camera,
  CircleGeometry,
  ConeGeometry,
  CylinderGeometry,
  DoubleSide,
  Group,
  Mesh,
  MeshBasicMaterial,
  MeshStandardMaterial,
  RingGeometry,
  SphereGeometry,
  Vector3,
  type BufferGeometry,
  type Material,
  type Object3D,
} from "three";
import { forceShare } from "../model/scale";
import { along, norm, unit, type Vec3 } from "../model/vec";
import { LEAST_FORCE, type Pose } from "./pose";

// Lengths in radii of the body.
const TIP = 0.045;
const LONGEST = 1.2; // arrow, and growth of the ring, for the largest force
const HEAD = 0.13;
const LINE = 0.016; // width of the ring
const STEM = 0.42;
const END_ON = Math.cos((25 * Math.PI) / 180); // an arrow seen from nearer to its axis would look like a blob

/** Distance from the middle of the tip at which the arrow of a force ends and its ring lies, in radii of the body. */
export function reach(force: number): number {
  return TIP + LONGEST * forceShare(force);
}

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
  private readonly ring: Mesh<RingGeometry, MeshBasicMaterial>;
  /** Direction of the force, and normal of the surface under the hand. */
  private readonly way = new Vector3();
  private readonly normal = new Vector3();
  private presence = 0;
  private readonly probe: Mesh;
  private readonly thread: Mesh;
  private readonly disc: Mesh<BufferGeometry, MeshBasicMaterial>;
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
    const sheet = new MeshBasicMaterial({ transparent: true, opacity: 0.2, side: DoubleSide, depthWrite: false });
    const round = new MeshBasicMaterial({ transparent: true, depthTest: false }); // a dent would hide it
    this.materials = [this.solid, this.flat, inside, sheet, round];
    this.tip = new Mesh(new SphereGeometry(TIP * radius, 24, 16), this.solid);
    this.stem = new Mesh(new CylinderGeometry(0.006 * radius, 0.006 * radius, 1, 8), this.flat);
    this.shaft = new Mesh(new CylinderGeometry(0.02 * radius, 0.02 * radius, 1, 16), this.solid);
    this.head = new Mesh(new ConeGeometry(0.055 * radius, HEAD * radius, 24), this.solid);
    this.ring = new Mesh(new RingGeometry(1, 2, 72, 1), round);
    this.ring.frustumCulled = false; // its points move, so its bounding sphere would be wrong
    this.probe = new Mesh(new SphereGeometry(0.022 * radius, 16, 12), inside);
    this.thread = new Mesh(new CylinderGeometry(0.004 * radius, 0.004 * radius, 1, 6), inside);
    this.disc = new Mesh(new CircleGeometry(patchRadius, 40), sheet);
    this.probe.renderOrder = this.thread.renderOrder = this.ring.renderOrder = 3;
    this.disc.renderOrder = 2;
    this.group.add(this.tip, this.stem, this.shaft, this.head, this.ring, this.probe, this.thread, this.disc);
  }

  paint(colour: string): void {
    for (const material of this.materials) {
      if (material instanceof MeshBasicMaterial || material instanceof MeshStandardMaterial) material.color.set(colour);
    }
  }

  pose(pose: Pose): void {
    const r = this.radius;
    const f = norm(pose.force);
    // The tip is drawn on the surface, or at the probe if the hand touches nothing.
    const tip = along(pose.proxy, TIP * r, pose.normal);
    this.tip.position.set(...tip);
    const way = f > LEAST_FORCE ? unit(pose.force) : pose.normal;
    const end = reach(f) * r;
    const stem = Math.max(STEM * r, end + 0.08 * r);
    between(this.stem, tip, along(tip, stem, way));
    this.anchor.set(...along(tip, stem + 0.04 * r, way));
    this.way.set(...way);
    this.normal.set(...pose.normal);
    this.presence = pose.presence;
    this.ring.visible = f > LEAST_FORCE;
    if (this.ring.visible) {
      between(this.shaft, tip, along(tip, Math.max(0, end - HEAD * r), way));
      this.head.position.set(...along(tip, end - 0.5 * HEAD * r, way));
      this.head.quaternion.setFromUnitVectors(UP, this.way);
      this.ring.position.set(...tip);
      widen(this.ring.geometry.getAttribute("position") as BufferAttribute, end - LINE * r, end);
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

  /** Turn the ring to the camera; show the arrow only where its length is visible. */
  face(camera: Camera): void {
    const sight = camera.position.clone().sub(this.tip.position).normalize();
    this.ring.quaternion.copy(camera.quaternion);
    // The ring of a hand behind the object is faint.
    this.ring.material.opacity = (this.normal.dot(sight) > 0 ? 0.9 : 0.3) * this.presence;
    this.shaft.visible = this.head.visible = this.ring.visible && Math.abs(this.way.dot(sight)) < END_ON;
  }

  dispose(): void {
    this.group.traverse((object: Object3D) => {
      if (object instanceof Mesh) (object as Mesh).geometry.dispose();
    });
    for (const material of this.materials) material.dispose();
  }

  private patch(pose: Pose, force: number): void {
    this.disc.visible = pose.held;
    if (!pose.held) return;
    this.disc.material.opacity = 0.2 * pose.presence * (force > LEAST_FORCE ? 1 : 0.5);
    this.disc.position.set(...along(pose.x_free, 0.004 * this.radius, pose.normal));
    this.disc.quaternion.setFromUnitVectors(OUT, new Vector3(...pose.normal));
    if (Math.abs(pose.curvature - this.bend) < 0.02 * Math.abs(this.bend) + 1e-3) return;
    this.bend = pose.curvature;
    bendDown(this.disc.geometry.getAttribute("position") as BufferAttribute, this.bend);
  }
}

/** All hands, by user. */
export class Hands {
  readonly group = new Group();
  /** A hidden hand: its shaders are compiled with the body's, so that the first real hand does not wait for them. */
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

  /** To be called before each picture, for the parts that depend on the camera. */
  face(camera: Camera): void {
    for (const hand of this.hands.values()) hand.face(camera);
  }

  /** Apply the colours of the new scheme, which depend on the background. */
  repaint(): void {
    for (const [user, hand] of this.hands) hand.paint(this.colour(user));
  }

  /** Place of a hand's name, world frame [m]; null without that hand. */
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

/** Set the radii of a flat ring; the first half of its points lies on the inner circle. */
function widen(position: BufferAttribute, inner: number, outer: number): void {
  const half = position.count / 2;
  for (let i = 0; i < position.count; i++) {
    const angle = (2 * Math.PI * (i % half)) / (half - 1);
    const radius = i < half ? inner : outer;
    position.setXY(i, radius * Math.cos(angle), radius * Math.sin(angle));
  }
  position.needsUpdate = true;
}

/** Bend a flat sheet away from +z as a sphere of this curvature does. */
function bendDown(position: BufferAttribute, curvature: number): void {
  for (let i = 0; i < position.count; i++) {
    const rr = position.getX(i) ** 2 + position.getY(i) ** 2;
    position.setZ(i, -0.5 * curvature * rr);
  }
  position.needsUpdate = true;
}
