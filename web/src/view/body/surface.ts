/** The drawn body: smooth, lit so that dents are visible, coloured by displacement or stiffness. */

import {
  BufferAttribute,
  BufferGeometry,
  Color,
  DynamicDrawUsage,
  Mesh,
  MeshStandardMaterial,
  type IUniform,
} from "three";
import type { RestMesh } from "../../model/body";
import { niceStep } from "../../model/scale";
import type { SceneSnapshot } from "../../model/scene";
import { DISPLACEMENT, PLAIN, type Scheme, STIFFNESS, table, toLinear } from "../../model/colours";
import { alongNormals } from "./normals";
import { Refiner } from "./refine";
import { StiffnessMap } from "./stiffness_map";

export type Colouring = "displacement" | "stiffness";

/** Content of the legend. */
export interface Legend {
  readonly colouring: Colouring;
  /** Ends of the map: [m] or [N/m]; null where nothing is known yet. */
  readonly low: number | null;
  readonly high: number | null;
}

const STEPS = 256;

export class Surface {
  readonly mesh: Mesh<BufferGeometry, MeshStandardMaterial>;
  colouring: Colouring = "displacement";
  /** Range of the displacement's map, in both directions [m]; it grows with the displacement. */
  private span: number;
  private scheme: Scheme = "light";
  private readonly refiner: Refiner;
  private readonly rest: Float32Array;
  private readonly restNormals: Float32Array;
  private readonly out: Float32Array;
  private readonly colours: Float32Array;
  private readonly stiffness: StiffnessMap;
  private readonly reach: number;
  private readonly contour: { uStep: IUniform<number>; uInk: IUniform<number> };

  constructor(rest: RestMesh, radius: number, contactRadius: number) {
    this.refiner = new Refiner(rest.vertices.length / 3, rest.faces);
    this.refiner.run(rest.vertices);
    this.rest = Float32Array.from(this.refiner.positions);
    this.restNormals = Float32Array.from(this.refiner.normals);
    const n = this.rest.length / 3;
    this.out = new Float32Array(n);
    this.colours = new Float32Array(3 * n);
    this.span = 0.1 * radius;
    this.stiffness = new StiffnessMap(this.rest);
    this.reach = Math.max(1.4 * contactRadius, 0.12 * radius);
    const geometry = new BufferGeometry();
    for (const [name, data, size] of [
      ["position", this.refiner.positions, 3],
      ["normal", this.refiner.normals, 3],
      ["color", this.colours, 3],
      ["along", this.out, 1],
    ] as const) {
      const attribute = new BufferAttribute(Float32Array.from(data), size);
      attribute.setUsage(DynamicDrawUsage);
      geometry.setAttribute(name, attribute);
    }
    geometry.setIndex(new BufferAttribute(this.refiner.faces, 1));
    // Contour lines as on a map: one every twentieth of the radius.
    this.contour = { uStep: { value: 0.04 * radius }, uInk: { value: 0.3 } };
    this.mesh = new Mesh(geometry, material(this.contour));
    this.mesh.frustumCulled = false;
    this.recolour();
  }

  setScheme(scheme: Scheme): void {
    this.scheme = scheme;
    this.contour.uInk.value = scheme === "light" ? 0.4 : 0.45;
    this.recolour();
  }

  setColouring(colouring: Colouring): void {
    this.colouring = colouring;
    this.recolour();
  }

  get legend(): Legend {
    if (this.colouring === "displacement") return { colouring: "displacement", low: -this.span, high: this.span };
    const { empty, low, high } = this.stiffness;
    return { colouring: "stiffness", low: empty ? null : low, high: empty ? null : high };
  }

  /** Take a new shape. */
  deform(positions: Float32Array): void {
    this.refiner.run(positions);
    const most = alongNormals(this.refiner.positions, this.rest, this.restNormals, this.out);
    if (most > this.span) this.span = niceStep(most);
    this.write("position", this.refiner.positions);
    this.write("normal", this.refiner.normals);
    this.write("along", this.out);
    if (this.colouring === "displacement") this.recolour();
  }

  /** Enter the stiffness at the present contacts into the map; returns whether the picture changed. */
  learn(view: SceneSnapshot): boolean {
    let changed = false;
    for (const user of view.users) {
      const pressed = user.c_ii > 0 && Math.hypot(...user.force) > 0.05;
      if (pressed) changed = this.stiffness.add(user.foot, 1 / user.c_ii, this.reach) || changed;
    }
    if (changed && this.colouring === "stiffness") this.recolour();
    return changed && this.colouring === "stiffness";
  }

  dispose(): void {
    this.mesh.geometry.dispose();
    this.mesh.material.dispose();
  }

  private write(name: string, data: Float32Array): void {
    const attribute = this.mesh.geometry.getAttribute(name);
    attribute.array.set(data);
    attribute.needsUpdate = true;
  }

  private recolour(): void {
    if (this.colouring === "displacement") {
      const map = table(DISPLACEMENT[this.scheme], STEPS);
      this.out.forEach((d, v) => {
        this.paint(v, map, 0.5 + (0.5 * d) / this.span);
      });
    } else {
      const map = table(STIFFNESS, STEPS);
      const plain = PLAIN[this.scheme].map(toLinear);
      const { low, high, values, known } = this.stiffness;
      const width = Math.max(high - low, 1e-9);
      values.forEach((k, v) => {
        this.paint(v, map, (k - low) / width);
        const share = known[v] ?? 0;
        for (let c = 0; c < 3; c++) {
          const i = 3 * v + c;
          this.colours[i] = share * (this.colours[i] ?? 0) + (1 - share) * (plain[c] ?? 0);
        }
      });
    }
    this.write("color", this.colours);
  }

  private paint(v: number, map: Float32Array, t: number): void {
    const i = 3 * Math.min(STEPS - 1, Math.max(0, Math.round(t * (STEPS - 1) || 0)));
    this.colours[3 * v] = map[i] ?? 0;
    this.colours[3 * v + 1] = map[i + 1] ?? 0;
    this.colours[3 * v + 2] = map[i + 2] ?? 0;
  }
}

/** Matt rubber with contour lines of displacement drawn into it. */
function material(contour: Record<string, IUniform>): MeshStandardMaterial {
  const made = new MeshStandardMaterial({ color: new Color(1, 1, 1), vertexColors: true, roughness: 0.6, metalness: 0 });
  made.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, contour);
    shader.vertexShader = shader.vertexShader
      .replace("#include <common>", "#include <common>\nattribute float along;\nvarying float vAlong;")
      .replace("#include <begin_vertex>", "#include <begin_vertex>\nvAlong = along;");
    shader.fragmentShader = shader.fragmentShader
      .replace("#include <common>", "#include <common>\nuniform float uStep;\nuniform float uInk;\nvarying float vAlong;")
      .replace("#include <color_fragment>", `#include <color_fragment>${CONTOURS}`);
  };
  return made;
}

/** Contour lines at half steps, so that a body at rest has none; thin at any zoom, and left out where they would crowd. */
const CONTOURS = `
  float level = vAlong / uStep;
  float perPixel = max(fwidth(level), 1e-6);
  float pixels = abs(fract(level) - 0.5) / perPixel;
  float ink = (1.0 - smoothstep(0.5, 1.5, pixels)) * (1.0 - smoothstep(0.15, 0.4, perPixel));
  diffuseColor.rgb *= 1.0 - uInk * ink;
`;
