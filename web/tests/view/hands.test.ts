import { type Mesh, PerspectiveCamera, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import { FULL_FORCE, forceShare } from "../../src/model/scale";
import { Hands, reach } from "../../src/view/hands";
import type { Pose } from "../../src/view/pose";

const RADIUS = 0.1; // m
const pressing = (force: number): Pose => ({
  user: 1, name: "ann", own: true, probe: [0, 0, RADIUS], proxy: [0, 0, RADIUS], normal: [0, 0, 1], force: [0, 0, force],
  x_free: [0, 0, RADIUS], curvature: 0, held: true, presence: 1,
});

/** The parts of one hand that show its force, seen from a place. */
function seen(force: number, eye: readonly [number, number, number]): { ring: Mesh; head: Mesh } {
  const hands = new Hands(RADIUS, 0.01, () => "#0a7f52");
  hands.pose([pressing(force)]);
  const camera = new PerspectiveCamera();
  camera.position.set(...eye);
  camera.lookAt(0, 0, RADIUS);
  hands.face(camera);
  const parts = (hands.group.children[1]?.children ?? []) as Mesh[];
  const found = (kind: string): Mesh => {
    const part = parts.find(({ geometry }) => geometry.type === kind);
    if (part === undefined) throw new Error(`no ${kind}`);
    return part;
  };
  return { ring: found("RingGeometry"), head: found("ConeGeometry") };
}

describe("the ring of a force", () => {
  it("reaches as far from the tip as the arrow does, from every side", () => {
    for (const force of [0.5, 2, 7, 30]) {
      for (const eye of [[0, 0, 1], [1, 0, 0.1], [0.5, -0.5, 0.5]] as const) {
        const { ring, head } = seen(force, eye);
        ring.geometry.computeBoundingSphere();
        expect(ring.geometry.boundingSphere?.radius).toBeCloseTo(reach(force) * RADIUS, 6);
        const point = head.position.clone().addScaledVector(new Vector3(0, 0, 1), 0.5 * 0.13 * RADIUS);
        expect(point.distanceTo(ring.position)).toBeCloseTo(reach(force) * RADIUS, 6);
      }
    }
  });

  it("faces the eye, and is fainter where the object lies between", () => {
    const opacity = (eye: readonly [number, number, number]): number => (seen(2, eye).ring.material as { opacity: number } & Mesh["material"]).opacity;
    const out = new Vector3(0, 0, 1).applyQuaternion(seen(2, [1, 0, 0.1]).ring.quaternion);
    expect(out.distanceTo(new Vector3(1, 0, 0))).toBeLessThan(1e-6);
    expect(opacity([0, 0, -1])).toBeLessThan(opacity([0, 0, 1]));
  });

  it("is there for a force alone, and stands in for an arrow that points at the eye", () => {
    expect(seen(0, [0, 0, 1]).ring.visible).toBe(false);
    expect(seen(0, [1, 0, 0]).head.visible).toBe(false);
    expect(seen(2, [0, 0, 1]).ring.visible).toBe(true);
    expect(seen(2, [0, 0, 1]).head.visible).toBe(false);
    expect(seen(2, [1, 0, 0]).head.visible).toBe(true);
  });
});

describe("a force by its size", () => {
  it("grows evenly to the largest one that the page renders", () => {
    expect(reach(4) - reach(2)).toBeCloseTo(reach(2) - reach(0), 12);
    expect([0, 0.5 * FULL_FORCE, FULL_FORCE, 3 * FULL_FORCE, -1].map(forceShare)).toEqual([0, 0.5, 1, 1, 0]);
  });
});
