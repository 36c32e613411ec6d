/** The object as a pointer meets it: its shape at rest, and as it is now. */

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
  /** Vertices as they are, shape (n, 3) [m]; the resting ones before anything was seen of them. */
  positions: Float32Array;
  /** Vertices as they were when a press took hold of the surface; null while none does. */
  private grasped: Float32Array | null = null;
  private readonly normals: Float32Array;

  constructor(readonly mesh: RestMesh) {
    this.positions = mesh.vertices;
    this.normals = vertexNormals(mesh.vertices, mesh.faces);
  }

  /** Where a ray meets the surface as it is; null beside it. */
  meet(origin: Vec3, direction: Vec3): Met | null {
    const hit = pick(this.positions, this.mesh.faces, origin, direction);
    return hit === null ? null : this.met(hit);
  }

  /** From now on `meetGrasped` goes by the surface as it is now. */
  grasp(): void {
    this.grasped = this.positions.slice();
  }

  /**
   * Where a ray would meet the surface as a press has found it. Seen from aside the place under a pointer that holds
   * still wanders as the press goes in, by the depth times the slope: on 10 mm seen from 40 degrees, 8 mm.
   */
  meetGrasped(origin: Vec3, direction: Vec3): Met | null {
    const hit = pick(this.grasped ?? this.positions, this.mesh.faces, origin, direction);
    return hit === null ? null : this.met(hit);
  }

  /** Where the resting surface looks in a direction from the middle of the body; null where it does not. */
  towards(direction: Vec3, center: Vec3, radius: number): Met | null {
    const hit = placeTowards(this.mesh.vertices, this.mesh.faces, center, direction, radius);
    return hit === null ? null : this.met(hit);
  }

  /** Of the surface as it is over the resting one, along its normal [m]. */
  height(place: Place): number {
    const { surface, normal, point } = this.met(place);
    return dot(sub(point, surface), normal);
  }

  private met(place: Place): Met {
    const { vertices, faces } = this.mesh;
    return { place, surface: at(vertices, faces, place), normal: unit(at(this.normals, faces, place)), point: at(this.positions, faces, place) };
  }
}
