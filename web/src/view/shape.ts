/** The shape of the object for pointers: at rest, and at present. */

import type { RestMesh } from "../model/body";
import { dot, sub, unit, type Vec3 } from "../model/vec";
import { vertexNormals } from "./body/normals";
import type { Place3 } from "./pointing/finger";
import { at, pick, type Place, placeTowards } from "./pointing/pick";

/** A place on the object, which stays with the material. */
export interface Met extends Place3 {
  readonly place: Place;
}

export class Shape {
  /** Present vertices, shape (n, 3) [m]; the resting ones before the first scene. */
  positions: Float32Array;
  /** Vertices at the time when a press grasped the surface; null before the first press. */
  private grasped: Float32Array | null = null;
  private readonly normals: Float32Array;

  constructor(readonly mesh: RestMesh) {
    this.positions = mesh.vertices;
    this.normals = vertexNormals(mesh.vertices, mesh.faces);
  }

  /** Place where a ray meets the present surface; null beside it. */
  meet(origin: Vec3, direction: Vec3): Met | null {
    const hit = pick(this.positions, this.mesh.faces, origin, direction);
    return hit === null ? null : this.met(hit);
  }

  /** Keep the present surface for `meetGrasped`. */
  grasp(): void {
    this.grasped = this.positions.slice();
  }

  /**
   * Place where a ray would meet the surface as it was when the press began. On the present surface, seen from the side,
   * the place under a still pointer would wander as the press goes in, by depth times slope: 8 mm for 10 mm at 40 degrees.
   */
  meetGrasped(origin: Vec3, direction: Vec3): Met | null {
    const hit = pick(this.grasped ?? this.positions, this.mesh.faces, origin, direction);
    return hit === null ? null : this.met(hit);
  }

  /** Outermost place of the resting surface in a direction from the middle of the body; null where there is none. */
  towards(direction: Vec3, center: Vec3, radius: number): Met | null {
    const hit = placeTowards(this.mesh.vertices, this.mesh.faces, center, direction, radius);
    return hit === null ? null : this.met(hit);
  }

  /** Height of the present surface over the resting one, along its normal [m]. */
  height(place: Place): number {
    const { surface, normal, point } = this.met(place);
    return dot(sub(point, surface), normal);
  }

  private met(place: Place): Met {
    const { vertices, faces } = this.mesh;
    return { place, surface: at(vertices, faces, place), normal: unit(at(this.normals, faces, place)), point: at(this.positions, faces, place) };
  }
}
