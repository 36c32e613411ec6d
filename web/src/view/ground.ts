/** The ground under the body: a shadow that shows the height of the floor, and rings round the fixed part. */

import { CanvasTexture, CircleGeometry, Color, Group, Mesh, MeshBasicMaterial, RingGeometry } from "three";
import type { RestMesh } from "../model/body";
import type { Scheme } from "../model/colours";

/** Lowest point of a mesh, and the mesh's middle and reach near that height [m]. */
export function footprint(mesh: RestMesh, radius: number): { z: number; x: number; y: number; reach: number } {
  const v = mesh.vertices;
  let z = Infinity;
  for (let i = 2; i < v.length; i += 3) z = Math.min(z, v[i] ?? 0);
  let x = 0;
  let y = 0;
  let count = 0;
  const near = z + 0.15 * radius;
  for (let i = 0; i + 2 < v.length; i += 3) {
    if ((v[i + 2] ?? 0) > near) continue;
    x += v[i] ?? 0;
    y += v[i + 1] ?? 0;
    count++;
  }
  x /= Math.max(1, count);
  y /= Math.max(1, count);
  let reach = 0;
  for (let i = 0; i + 2 < v.length; i += 3) {
    if ((v[i + 2] ?? 0) <= near) reach = Math.max(reach, Math.hypot((v[i] ?? 0) - x, (v[i + 1] ?? 0) - y));
  }
  return { z, x, y, reach };
}

export class Ground {
  readonly group = new Group();
  private readonly shadow: MeshBasicMaterial;
  private readonly line: MeshBasicMaterial;

  constructor(mesh: RestMesh, radius: number) {
    const foot = footprint(mesh, radius);
    this.shadow = new MeshBasicMaterial({ map: blob(), transparent: true, depthWrite: false });
    this.line = new MeshBasicMaterial({ transparent: true, depthWrite: false });
    const shade = new Mesh(new CircleGeometry(1.7 * radius, 64), this.shadow);
    // The ring marks the ground on which the body is held.
    const ring = new Mesh(new RingGeometry(1.28 * radius, 1.287 * radius, 128), this.line);
    const held = new Mesh(new RingGeometry(foot.reach, foot.reach + 0.014 * radius, 96), this.line);
    shade.position.set(foot.x, foot.y, foot.z - 0.004 * radius);
    ring.position.set(foot.x, foot.y, foot.z - 0.003 * radius);
    held.position.set(foot.x, foot.y, foot.z - 0.002 * radius);
    this.group.add(shade, ring, held);
  }

  setScheme(scheme: Scheme): void {
    this.shadow.color = new Color(scheme === "light" ? "#2a3038" : "#000000");
    this.shadow.opacity = scheme === "light" ? 0.34 : 0.7;
    this.line.color = new Color(scheme === "light" ? "#3a434e" : "#c8d2dc");
    this.line.opacity = scheme === "light" ? 0.16 : 0.14;
  }

  dispose(): void {
    this.shadow.map?.dispose();
    this.shadow.dispose();
    this.line.dispose();
    for (const child of this.group.children) if (child instanceof Mesh) (child as Mesh).geometry.dispose();
  }
}

/** A painted texture of a soft round shadow. */
function blob(): CanvasTexture {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 256;
  const context = canvas.getContext("2d");
  if (context !== null) {
    const gradient = context.createRadialGradient(128, 128, 0, 128, 128, 128);
    for (let i = 0; i <= 16; i++) {
      const s = i / 16;
      gradient.addColorStop(s, `rgba(255,255,255,${((1 - s) ** 2 * (1 + 2 * s) * 0.95).toFixed(3)})`);
    }
    context.fillStyle = gradient;
    context.fillRect(0, 0, 256, 256);
  }
  return new CanvasTexture(canvas);
}
