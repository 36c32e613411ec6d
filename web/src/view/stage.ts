/** The stage: renderer, camera, light. It draws when something moved, and not otherwise. */

import {
  DirectionalLight,
  HemisphereLight,
  NeutralToneMapping,
  PerspectiveCamera,
  Raycaster,
  Scene,
  Vector2,
  Vector3,
  WebGLRenderer,
} from "three";
import type { Vec3 } from "../model/vec";
import type { Scheme } from "../model/colours";
import { FramePace, isSoftware } from "./frame_pace";
import { roomLight } from "./light";
import { eased, eye, HOME, nearTurn, type Orbit } from "./orbit";

/** A canvas's graphics, and whether the processor draws them, which the hand's loop needs too. */
export interface Graphics {
  readonly canvas: HTMLCanvasElement;
  readonly context: WebGL2RenderingContext;
  readonly software: boolean;
}

export class Stage {
  readonly scene = new Scene();
  readonly camera = new PerspectiveCamera(32, 1, 0.001, 100);
  readonly canvas: HTMLCanvasElement;
  /** Target of the camera, which follows smoothly. */
  target: Orbit = HOME;
  /** How far the body stands beside the middle of the picture, to the right [m]. */
  aside = 0;
  /** Softly, or at once for people who asked for less motion. */
  still = false;

  private readonly renderer: WebGLRenderer;
  private readonly key = new DirectionalLight(0xffffff, 1.6);
  private readonly sky = new HemisphereLight(0xffffff, 0x8890a0, 0.5);
  private readonly room = roomLight();
  private orbit: Orbit = HOME;
  private center: Vec3 = [0, 0, 0];
  private radius = 0.1;
  private dirty = true;
  private lift = 0;
  private readonly sizes = new ResizeObserver(() => { this.resize(); });
  private readonly pace: FramePace;
  /** Shaders that are still being compiled. */
  private compiling = 0;

  constructor(host: HTMLElement, { canvas, context, software }: Graphics) {
    this.pace = new FramePace(software, Math.min(window.devicePixelRatio, 2));
    this.renderer = new WebGLRenderer({ canvas, context, alpha: true });
    this.canvas = canvas;
    this.canvas.className = "stage-canvas";
    this.renderer.toneMapping = NeutralToneMapping;
    host.append(this.canvas);
    this.camera.up.set(0, 0, 1);
    this.scene.add(this.key, this.key.target, this.sky, this.room);
    this.sizes.observe(host);
    this.resize();
  }

  /** Graphics that the system took away, and that it gives back: what was on them is gone. */
  watch(lost: () => void, restored: () => void): void {
    this.canvas.addEventListener("webglcontextlost", (event) => {
      event.preventDefault(); // else it is never given back
      lost();
    });
    this.canvas.addEventListener("webglcontextrestored", restored);
  }

  /** Off the page; another stage takes its place. */
  dispose(): void {
    this.sizes.disconnect();
    this.renderer.dispose();
    this.canvas.remove();
  }

  /** Look at another body. */
  frame(center: Vec3, radius: number): void {
    this.center = center;
    this.radius = radius;
    this.camera.near = 0.02 * radius;
    this.camera.far = 60 * radius;
    this.touch();
  }

  setScheme(scheme: Scheme): void {
    this.renderer.toneMappingExposure = scheme === "light" ? 1.0 : 0.95;
    this.key.intensity = scheme === "light" ? 1.6 : 1.6;
    this.sky.intensity = scheme === "light" ? 0.2 : 0.12;
    this.room.intensity = scheme === "light" ? 0.5 : 0.8;
    this.touch();
  }

  /** Keep the body in the middle of the visible part: `above` and `below` are covered [px]. */
  uncover(above: number, below: number): void {
    const lift = Math.round(0.5 * (below - above));
    if (lift === this.lift) return;
    this.lift = lift;
    this.touch();
  }

  /** Compile the shaders of what was added all at once, beside the page where the browser can; then it is drawn. */
  compile(): void {
    if (!this.renderer.extensions.has("KHR_parallel_shader_compile")) {
      this.renderer.compile(this.scene, this.camera);
      return;
    }
    this.compiling += 1;
    void this.renderer.compileAsync(this.scene, this.camera).finally(() => {
      this.compiling -= 1;
      this.touch();
    });
  }

  /** Something changed: draw at the next chance. */
  touch(): void {
    this.dirty = true;
  }

  /** Turn by the short way to a view. */
  goTo(orbit: Orbit): void {
    this.target = nearTurn(orbit, this.orbit);
    this.touch();
  }

  /** @returns Whether a frame was drawn. */
  draw(dt: number): boolean {
    const before = this.orbit;
    this.orbit = this.still ? this.target : eased(this.orbit, this.target, dt);
    this.dirty ||= this.orbit !== before;
    const { ratio } = this.pace;
    const draws = this.pace.next(dt, this.dirty && this.compiling === 0);
    if (this.pace.ratio !== ratio) this.resize();
    if (!draws) return false;
    this.dirty = false;
    this.place();
    this.renderer.render(this.scene, this.camera);
    return true;
  }

  /** From the eye through a point of the window. */
  ray(x: number, y: number): { origin: Vec3; direction: Vec3 } {
    const box = this.canvas.getBoundingClientRect();
    const at = new Vector2((2 * (x - box.left)) / box.width - 1, 1 - (2 * (y - box.top)) / box.height);
    const caster = new Raycaster();
    caster.setFromCamera(at, this.camera);
    return { origin: caster.ray.origin.toArray(), direction: caster.ray.direction.toArray() };
  }

  /** Through the middle of the picture. */
  middle(): { origin: Vec3; direction: Vec3 } {
    const box = this.canvas.getBoundingClientRect();
    return this.ray(box.left + 0.5 * box.width, box.top + 0.5 * box.height);
  }

  /** From the middle of the body towards the eye. */
  towardsEye(): Vec3 {
    return eye({ ...this.orbit, distance: 1 }, [0, 0, 0], 1);
  }

  /** Where a point appears, in pixels of the canvas; null behind the eye. */
  project(point: Vec3): { x: number; y: number } | null {
    const p = new Vector3(...point).project(this.camera);
    if (p.z > 1) return null;
    return { x: 0.5 * (p.x + 1) * this.canvas.clientWidth, y: 0.5 * (1 - p.y) * this.canvas.clientHeight };
  }

  private place(): void {
    // A narrow window sees less to the sides: step back until the body fits.
    const back = Math.max(1, 1.22 / this.camera.aspect);
    const from = eye({ ...this.orbit, distance: this.orbit.distance * back }, this.center, this.radius);
    this.camera.position.set(...from);
    this.camera.lookAt(...this.center);
    this.camera.updateMatrixWorld();
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const away = Math.hypot(...from.map((x, k) => x - (this.center[k] ?? 0)));
    const pixels = (0.5 * height) / (away * Math.tan((0.5 * this.camera.fov * Math.PI) / 180)); // for a metre
    this.camera.setViewOffset(width, height, -this.aside * pixels, this.lift, width, height);
    // The light comes over the viewer's left shoulder, so that dents show from every side.
    const light = eye({ azimuth: this.orbit.azimuth - 1.05, elevation: 0.72, distance: 6 }, this.center, this.radius);
    this.key.position.set(...light);
    this.key.target.position.set(...this.center);
  }

  private resize(): void {
    const host = this.canvas.parentElement;
    if (host === null) return;
    const width = Math.max(1, host.clientWidth);
    const height = Math.max(1, host.clientHeight);
    this.renderer.setPixelRatio(this.pace.ratio);
    this.renderer.setSize(width, height);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.touch();
  }
}

/** A stage where the browser can have one; null without WebGL. */
export function openStage(host: HTMLElement): Stage | null {
  const graphics = openGraphics();
  if (graphics === null) return null;
  try {
    const stage = new Stage(host, graphics);
    stage.still = matchMedia("(prefers-reduced-motion: reduce)").matches;
    return stage;
  } catch {
    return null;
  }
}

/** Asked for before three.js does, which would fill the console where there are none. */
function openGraphics(): Graphics | null {
  const plain = openContext({ antialias: false });
  if (plain === null || isSoftware(rendererOf(plain.context))) return plain && { ...plain, software: true };
  // A browser that does not name what draws, or by another name, may still say that it is slow.
  const smooth = openContext({ antialias: true, failIfMajorPerformanceCaveat: true });
  if (smooth === null) return { ...plain, software: true };
  plain.context.getExtension("WEBGL_lose_context")?.loseContext();
  return { ...smooth, software: false };
}

function openContext(wanted: WebGLContextAttributes): Omit<Graphics, "software"> | null {
  const canvas = document.createElement("canvas");
  const context = canvas.getContext("webgl2", { alpha: true, stencil: false, powerPreference: "high-performance", ...wanted });
  return context && { canvas, context };
}

/** What draws, in the words of its driver. */
function rendererOf(context: WebGL2RenderingContext): string {
  const names = context.getExtension("WEBGL_debug_renderer_info");
  return String(context.getParameter(names?.UNMASKED_RENDERER_WEBGL ?? context.RENDERER));
}
