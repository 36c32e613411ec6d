/** Picture of an object before it is prepared, with its held part in another colour; the visitor can turn it and paint on it. */

import { BufferAttribute, BufferGeometry, Color, Data3DTexture, Mesh, MeshStandardMaterial, RedFormat, Vector3 } from "three";
import type { RestMesh } from "../model/body";
import type { Vec3 } from "../model/vec";
import { type Box, boxOf, type Layer, layerEnd, Painting } from "../upload/held";
import { vertexNormals } from "./body/normals";
import { HOME, type Orbit, rotated, zoomed } from "./orbit";
import { pick } from "./pointing/pick";
import { attachPointer } from "./pointing/pointer";
import { type Reference, referenceFor } from "./reference";
import { openStage, type Stage } from "./stage";

const FLESH = 0xd3ab98;
const AWAY = 3.5; // radii of the object from its middle to the eye
const FROM_BELOW = -0.4; // rad
const HELD = "#2b7fd0";
const REACH = 0.9; // radii of the object's ball, half the width of the object in the picture
const GAP = 0.15; // radii of the object, between the object and the thing beside it
const WIDE = 1.2; // half the picture's width over the radius that the camera frames
const TURN = 0.12; // rad per key press

/** The held part of the object. */
export type Held = { readonly by: "layer"; readonly layer: Layer } | { readonly by: "paint" };

interface Shown {
  readonly mesh: RestMesh;
  readonly box: Box;
  readonly center: Vec3;
  readonly radius: number;
  readonly object: Mesh<BufferGeometry, MeshStandardMaterial>;
  readonly painting: Painting;
  readonly texture: Data3DTexture;
}

export class Preview {
  /** The stage; null without WebGL: nothing is shown then, and the rest of the dialog works. */
  private readonly stage: Stage | null;
  private shown: Shown | null = null;
  private held: Held = { by: "paint" };
  private last = 0;
  private running = false;
  private beside: Reference | null = null;
  private readonly uniforms = {
    uAxis: { value: new Vector3(0, 0, 1) },
    uEnd: { value: 0 },
    uPainted: { value: 0 },
    uMask: { value: null as Data3DTexture | null },
    uOrigin: { value: new Vector3() },
    uSize: { value: new Vector3(1, 1, 1) },
    uHeld: { value: new Color(HELD) },
  };

  /** @param painted Called when the painted part has changed. */
  constructor(host: HTMLElement, private readonly painted: () => void) {
    this.stage = openStage(host);
    const stage = this.stage;
    if (stage === null) return;
    stage.setScheme("light");
    host.addEventListener("keydown", (event) => { this.key(event); });
    attachPointer(host, {
      press: (x, y) => this.paint(x, y),
      slide: (x, y) => { this.paint(x, y); },
      hover: () => undefined,
      release: () => undefined,
      deeper: () => undefined,
      depth: () => undefined,
      rotate: (right, up) => { stage.target = rotated(stage.target, right, up); stage.touch(); },
      zoom: (factor) => { stage.target = zoomed(stage.target, factor); stage.touch(); },
      took: () => undefined, point: () => false, pointing: () => false,
    });
  }

  get painting(): Painting | null {
    return this.shown?.painting ?? null;
  }

  get box(): Box | null {
    return this.shown?.box ?? null;
  }

  show(mesh: RestMesh): void {
    this.clear();
    const box = boxOf(mesh.vertices);
    const painting = new Painting(box);
    const [nx, ny, nz] = painting.counts;
    const texture = new Data3DTexture(painting.cells, nx, ny, nz);
    texture.format = RedFormat;
    texture.unpackAlignment = 1;
    const object = new Mesh(geometryOf(mesh), this.material());
    this.uniforms.uMask.value = texture;
    this.uniforms.uOrigin.value.set(...painting.origin);
    this.uniforms.uSize.value.set(nx, ny, nz).multiplyScalar(painting.cell);
    const center = [0, 1, 2].map((k) => 0.5 * ((box.low[k] ?? 0) + (box.high[k] ?? 0))) as unknown as Vec3;
    const radius = 0.5 * Math.hypot(...[0, 1, 2].map((k) => (box.high[k] ?? 0) - (box.low[k] ?? 0)));
    this.shown = { mesh, box, center, radius, object, painting, texture };
    this.stage?.scene.add(object);
    this.stage?.frame(center, radius);
    this.refresh();
  }

  /**
   * Show a familiar thing in its true size beside the object.
   *
   * @param larger How many times larger the object will be than it is here.
   * @returns Words for the thing; empty if nothing is shown.
   */
  compare(larger: number): string {
    const { shown, stage } = this;
    if (shown === null || stage === null) return "";
    this.removeReference();
    const longest = Math.max(...[0, 1, 2].map((k) => (shown.box.high[k] ?? 0) - (shown.box.low[k] ?? 0)));
    this.beside = referenceFor(larger * longest);
    const { root, width, height, words } = this.beside;
    root.scale.setScalar(1 / larger);
    stage.scene.add(root);
    const further = GAP * shown.radius + width / larger;
    stage.aside = 0.5 * further;
    const needed = (REACH * shown.radius + 0.5 * further) / WIDE;
    stage.frame(shown.center, Math.max(shown.radius, needed, (0.55 * height) / larger));
    return words;
  }

  /** Colour the part that is held. */
  hold(held: Held): void {
    this.held = held;
    const { shown, uniforms } = this;
    if (shown === null) return;
    uniforms.uPainted.value = held.by === "paint" ? 1 : 0;
    if (held.by === "layer") {
      const { axis, sign } = held.layer;
      uniforms.uAxis.value.set(0, 0, 0).setComponent(axis, sign);
      uniforms.uEnd.value = sign * layerEnd(held.layer, shown.box);
      this.stage?.goTo(towards(held.layer));
    }
    this.stage?.touch();
  }

  /** Set whether the picture is drawn, which is while it is visible. */
  run(on: boolean): void {
    if (on && !this.running) requestAnimationFrame((t) => { this.frame(t / 1000); });
    this.running = on;
    this.stage?.touch();
  }

  /** To be called after a change of the painted part. */
  refresh(): void {
    if (this.shown !== null) this.shown.texture.needsUpdate = true;
    this.stage?.touch();
  }

  clear(): void {
    this.removeReference();
    if (this.shown === null) return;
    const { object, texture } = this.shown;
    this.stage?.scene.remove(object);
    object.geometry.dispose();
    object.material.dispose();
    texture.dispose();
    this.shown = null;
  }

  private frame(now: number): void {
    if (!this.running) return;
    requestAnimationFrame((t) => { this.frame(t / 1000); });
    this.faceEye();
    this.stage?.draw(Math.min(0.1, now - this.last));
    this.last = now;
  }

  /** Keep the thing beside the object on the object's left, facing the eye. */
  private faceEye(): void {
    const { beside, shown, stage } = this;
    if (beside === null || shown === null || stage === null) return;
    const { root, width, height } = beside;
    const scale = root.scale.x;
    root.quaternion.copy(stage.camera.quaternion);
    const aside = -((REACH + GAP) * shown.radius + 0.5 * width * scale);
    root.position.set(aside, -0.5 * height * scale, 0).applyQuaternion(stage.camera.quaternion).add(new Vector3(...shown.center));
  }

  private removeReference(): void {
    if (this.beside === null) return;
    if (this.stage !== null) this.stage.aside = 0;
    this.stage?.scene.remove(this.beside.root);
    this.beside.dispose();
    this.beside = null;
  }

  private key(event: KeyboardEvent): void {
    const { stage } = this;
    if (stage === null || event.ctrlKey || event.metaKey || event.altKey) return; // these keys belong to the browser
    const turns: Readonly<Record<string, readonly [number, number]>> = {
      ArrowLeft: [-TURN, 0], ArrowRight: [TURN, 0], ArrowUp: [0, TURN], ArrowDown: [0, -TURN],
    };
    const turn = turns[event.key];
    if (turn !== undefined) stage.target = rotated(stage.target, ...turn);
    else if ("+=".includes(event.key)) stage.target = zoomed(stage.target, 0.85);
    else if ("-_".includes(event.key)) stage.target = zoomed(stage.target, 1 / 0.85);
    else return;
    event.preventDefault();
    stage.touch();
  }

  /** Paint under the pointer. @returns Whether the pointer is on the object and paints. */
  private paint(x: number, y: number): boolean {
    const { stage, shown } = this;
    if (stage === null || shown === null || this.held.by !== "paint") return false;
    const { origin, direction } = stage.ray(x, y);
    const hit = pick(shown.mesh.vertices, shown.mesh.faces, origin, direction);
    if (hit === null) return false;
    if (shown.painting.paint(hit.point)) {
      this.refresh();
      this.painted();
    }
    return true;
  }

  private material(): MeshStandardMaterial {
    const made = new MeshStandardMaterial({ color: FLESH, roughness: 0.62 });
    made.onBeforeCompile = (shader) => {
      Object.assign(shader.uniforms, this.uniforms);
      shader.vertexShader = shader.vertexShader
        .replace("#include <common>", "#include <common>\nvarying vec3 vRest;")
        .replace("#include <begin_vertex>", "#include <begin_vertex>\nvRest = position;");
      shader.fragmentShader = shader.fragmentShader
        .replace("#include <common>", `#include <common>
          varying vec3 vRest;
          uniform vec3 uAxis, uOrigin, uSize, uHeld;
          uniform float uEnd, uPainted;
          uniform highp sampler3D uMask;`)
        .replace("#include <color_fragment>", `#include <color_fragment>
          float held = uPainted > 0.5 ? step(0.5, texture(uMask, (vRest - uOrigin) / uSize).r) : step(uEnd, dot(uAxis, vRest));
          diffuseColor.rgb = mix(diffuseColor.rgb, uHeld, 0.85 * held);`);
    };
    return made;
  }
}

/** A view that shows a held side. */
function towards({ axis, sign }: Layer): Orbit {
  if (axis === 2) return { azimuth: HOME.azimuth, elevation: sign < 0 ? FROM_BELOW : 0.7, distance: AWAY };
  const side = axis === 0 ? (sign < 0 ? Math.PI : 0) : 0.5 * sign * Math.PI;
  return { azimuth: side - 0.5, elevation: HOME.elevation, distance: AWAY };
}

function geometryOf(mesh: RestMesh): BufferGeometry {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(mesh.vertices, 3));
  geometry.setAttribute("normal", new BufferAttribute(vertexNormals(mesh.vertices, mesh.faces), 3));
  geometry.setIndex(new BufferAttribute(mesh.faces, 1));
  return geometry;
}
