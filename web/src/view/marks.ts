/** Places at which people point: a ring on the surface and a name, for a few seconds. */

import { DoubleSide, Group, Mesh, MeshBasicMaterial, Quaternion, RingGeometry, Vector3 } from "three";
import type { RestMesh } from "../model/body";
import { type Mark, MARK_LASTS } from "../model/company";
import { along, row, sub, unit, type Vec3 } from "../model/vec";
import { vertexNormals } from "./body/normals";

const OUT = new Vector3(0, 0, 1);
const PULSE = 1.2; // s in which one ring widens

interface Shown {
  readonly ring: Mesh<RingGeometry, MeshBasicMaterial>;
  readonly box: HTMLElement;
  readonly vertex: number;
  readonly normal: Vec3;
}

/** The resting vertex nearest to a point, so that a mark lies on the surface wherever its message put it. */
export function nearestVertex(vertices: Float32Array, point: Vec3): number {
  let [best, least] = [0, Infinity];
  for (let i = 0; i < vertices.length / 3; i++) {
    const [x, y, z] = sub(row(vertices, i), point);
    const distance = x * x + y * y + z * z;
    if (distance < least) [best, least] = [i, distance];
  }
  return best;
}

export class Marks {
  readonly group = new Group();
  private readonly shown = new Map<Mark, Shown>();
  private normals: Float32Array | null = null;

  /**
   * @param host Element that contains the names.
   * @param radius Radius of the body [m].
   */
  constructor(private readonly host: HTMLElement, private readonly mesh: RestMesh, private readonly radius: number) {}

  /** Whether there is anything to draw. */
  get any(): boolean {
    return this.shown.size > 0;
  }

  /**
   * Show the marks that are young enough.
   *
   * @param positions Present positions of the vertices, shape (n, 3) [m].
   * @param colour Colour of a user; null stands for people who only watch.
   * @param still Whether the visitor asked for less motion: no ring widens then.
   */
  place(marks: readonly Mark[], positions: Float32Array, now: number, colour: (user: number | null) => string, still: boolean, project: (point: Vec3) => { x: number; y: number } | null): void {
    const young = marks.filter((mark) => now - mark.at < MARK_LASTS);
    for (const [mark, shown] of this.shown) {
      if (!young.includes(mark)) this.remove(mark, shown);
    }
    for (const mark of young) {
      const shown = this.shown.get(mark) ?? this.make(mark);
      const age = now - mark.at;
      const at = along(row(positions, shown.vertex), 0.02 * this.radius, shown.normal);
      const paint = colour(mark.user);
      shown.ring.position.set(...at);
      shown.ring.scale.setScalar(still ? 1 : 0.6 + 0.8 * ((age % PULSE) / PULSE));
      shown.ring.material.color.set(paint);
      shown.ring.material.opacity = still ? 0.95 : Math.min(1, MARK_LASTS - age);
      shown.box.style.setProperty("--user", paint);
      const pixel = project(along(at, 0.12 * this.radius, shown.normal));
      shown.box.classList.toggle("gone", pixel === null);
      if (pixel === null) continue;
      const half = 0.5 * shown.box.offsetWidth;
      const x = Math.min(this.host.clientWidth - half - 6, Math.max(half + 6, pixel.x));
      const y = Math.min(this.host.clientHeight - 20, Math.max(20, pixel.y - 20));
      shown.box.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px) translate(-50%, -50%)`;
    }
  }

  dispose(): void {
    for (const [mark, shown] of this.shown) this.remove(mark, shown);
  }

  private make(mark: Mark): Shown {
    this.normals ??= vertexNormals(this.mesh.vertices, this.mesh.faces);
    const vertex = nearestVertex(this.mesh.vertices, mark.point);
    const normal = unit(row(this.normals, vertex));
    // Drawn over everything, so that a mark on the far side is visible, too.
    const material = new MeshBasicMaterial({ transparent: true, side: DoubleSide, depthTest: false, depthWrite: false });
    const ring = new Mesh(new RingGeometry(0.075 * this.radius, 0.1 * this.radius, 40), material);
    ring.renderOrder = 4;
    ring.quaternion.copy(new Quaternion().setFromUnitVectors(OUT, new Vector3(...normal)));
    const box = document.createElement("div");
    box.className = "label mark";
    const name = document.createElement("span");
    name.className = "label-name";
    name.textContent = mark.user === null ? `${mark.name} (watching)` : mark.name;
    box.append(name);
    this.host.append(box);
    this.group.add(ring);
    const shown = { ring, box, vertex, normal };
    this.shown.set(mark, shown);
    return shown;
  }

  private remove(mark: Mark, { ring, box }: Shown): void {
    this.shown.delete(mark);
    this.group.remove(ring);
    ring.geometry.dispose();
    ring.material.dispose();
    box.remove();
  }
}
