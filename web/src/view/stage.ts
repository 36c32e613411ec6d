/** The stage: renderer, camera and light. It draws only when something has moved. */

import {
  DirectionalLight,
  HemisphereLight,
  NeutralToneMapping,
  PerspectiveCamera,
  Scene,
  Vector3,
  WebGLRenderer,
} from "three";
import type { Vec3 } from "../model/vec";
import type { Scheme } from "../model/colours";
import type { DeferredPicture } from "./graphics/deferred_picture";
import { FramePace } from "./graphics/frame_pace";
import { type Graphics, openGraphics } from "./graphics/graphics";
import { roomLight } from "./light";
import { eased, eye, HOME, nearTurn, type Orbit } from "./orbit";
import type { Leaning } from "./pointing/leaning";

export class Stage {
  readonly scene = new Scene();
  readonly camera = new PerspectiveCamera(32, 1, 0.001, 100);
  readonly canvas: HTMLCanvasElement;
  /** The camera without its lean: a press in progress uses this one, so that a lean does not move the hand. */
  readonly straight = new PerspectiveCamera();
  /** Turns the camera off the normal of the pressed place; null until the first press. */
  leaning: Leaning | null = null;
  /** Shift of the picture in its frame, to the right and up [px]. */
  moved = { x: 0, y: 0 };
  /** Target of the camera, which follows smoothly. */
  target: Orbit = HOME;
  /** Distance of the body to the right of the picture's middle [m]. */
  aside = 0;
  /** Heights that are covered at the top and at the foot of the picture [px]. */
  clear: readonly [number, number] = [0, 0];
  /** Called with the camera before each picture. */
  placed: (camera: PerspectiveCamera) => void = () => undefined;
  /** Whether the camera moves at once, for people who asked for less motion. */
  still = false;

  private readonly renderer: WebGLRenderer;
  private readonly key = new DirectionalLight(0xffffff, 1.6);
  private readonly sky = new HemisphereLight(0xffffff, 0x8890a0, 0.5);
  private readonly room = roomLight();
  private orbit: Orbit = HOME;
  /** View of the newest picture, shown or being drawn. */
  private taken: Orbit = HOME;
  private center: Vec3 = [0, 0, 0];
  private radius = 0.1;
  private dirty = true;
  private lift = 0;
  private readonly sizes = new ResizeObserver(() => { this.resize(); });
  private readonly pace: FramePace;
  /** Used if the processor draws, when its code is loaded; null draws on the canvas itself, for which no browser waits. */
  private deferred: DeferredPicture | null = null;
  private readonly pause = (): void => { this.pace.pause(); };
  private gone = false;
  /** Number of compilations of shaders that still run. */
  private compiling = 0;
  /** Whether the canvas has still to be resized to its host, which waits until the present picture is drawn. */
  private sizeDue = false;

  constructor(host: HTMLElement, { canvas, context, software }: Graphics) {
    this.pace = new FramePace(software, finest());
    document.addEventListener("visibilitychange", this.pause);
    this.renderer = new WebGLRenderer({ canvas, context, alpha: true });
    if (software) void this.defer(context);
    this.canvas = canvas;
    this.canvas.className = "stage-canvas";
    this.renderer.toneMapping = NeutralToneMapping;
    host.append(this.canvas);
    this.camera.up.set(0, 0, 1);
    this.scene.add(this.key, this.key.target, this.sky, this.room);
    this.sizes.observe(host);
    this.resize();
  }

  /** Call back when the system takes the graphics away, and when it gives them back; their contents are gone. */
  watch(lost: () => void, restored: () => void): void {
    this.canvas.addEventListener("webglcontextlost", (event) => {
      event.preventDefault(); // otherwise the context is never given back
      lost();
    });
    this.canvas.addEventListener("webglcontextrestored", restored);
  }

  /** Remove the stage from the page, for another one to take its place. */
  dispose(): void {
    this.gone = true;
    this.sizes.disconnect();
    document.removeEventListener("visibilitychange", this.pause);
    this.deferred?.dispose();
    this.renderer.dispose();
    this.canvas.remove();
  }

  /** Aim the camera at another body. */
  frame(center: Vec3, radius: number): void {
    this.center = center;
    this.radius = radius;
    this.camera.near = 0.02 * radius;
    this.camera.far = 60 * radius;
    this.touch();
  }

  setScheme(scheme: Scheme): void {
    this.renderer.toneMappingExposure = scheme === "light" ? 1.0 : 0.95;
    this.sky.intensity = scheme === "light" ? 0.2 : 0.12;
    this.room.intensity = scheme === "light" ? 0.5 : 0.8;
    this.touch();
  }

  /** Keep the body in the middle of the visible part: `above` and `below` are covered [px]. */
  uncover(above: number, below: number): void {
    this.clear = [above, below];
    const lift = Math.round(0.5 * (below - above));
    if (lift === this.lift) return;
    this.lift = lift;
    this.touch();
  }

  /** Compile all shaders of added parts at once, in parallel where the browser can; the parts are drawn afterwards. */
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

  /** Draw at the next chance, because something has changed. */
  touch(): void {
    this.dirty = true;
  }

  /** Turn to a view by the shorter way. */
  goTo(orbit: Orbit): void {
    this.target = nearTurn(orbit, this.orbit);
    this.touch();
  }

  /** Draw if it is needed and possible. @returns Whether there is a new picture. */
  draw(dt: number): boolean {
    const before = this.orbit;
    this.orbit = this.still ? this.target : eased(this.orbit, this.target, dt);
    const leant = this.leaning?.step(dt) === true;
    // No event tells that a window was dragged to another display or zoomed.
    this.pace.fit(finest());
    const resized = this.pace.ratio !== this.renderer.getPixelRatio();
    this.dirty ||= this.orbit !== before || leant || resized;
    const finished = this.deferred?.finish(dt) === true;
    if (finished) this.tell();
    if (finished && this.sizeDue) this.resize();
    const draws = this.pace.next(dt, this.dirty && this.compiling === 0, this.deferred?.drawing);
    // No picture is begun in the frame in which one is shown.
    if (!draws) return finished;
    // Resized only now, because a resized canvas is empty.
    if (this.pace.ratio !== this.renderer.getPixelRatio()) this.resize();
    this.dirty = false;
    this.place();
    this.taken = this.orbit;
    const render = (): void => { this.renderer.render(this.scene, this.camera); };
    if (this.deferred !== null) {
      this.deferred.begin(render);
      return false;
    }
    render();
    this.tell();
    return true;
  }

  /** Ray from the eye through a point of the window, as if the camera did not lean. */
  ray(x: number, y: number): { origin: Vec3; direction: Vec3 } {
    return this.rayOf(this.straight, x, y);
  }

  /** Ray through a point of the window, to the place that is seen there. */
  seen(x: number, y: number): { origin: Vec3; direction: Vec3 } {
    return this.rayOf(this.camera, x, y);
  }

  /** Place in the window where a point would appear if the camera did not lean. */
  unleaned(point: Vec3): { x: number; y: number } {
    const { left, top, width, height } = this.canvas.getBoundingClientRect();
    const p = new Vector3(...point).project(this.straight);
    return { x: left + 0.5 * (p.x + 1) * width, y: top + 0.5 * (1 - p.y) * height };
  }

  private rayOf(camera: PerspectiveCamera, x: number, y: number): { origin: Vec3; direction: Vec3 } {
    const box = this.canvas.getBoundingClientRect();
    const from = new Vector3().setFromMatrixPosition(camera.matrixWorld);
    const at = new Vector3((2 * (x - box.left)) / box.width - 1, 1 - (2 * (y - box.top)) / box.height, 0.5);
    return { origin: from.toArray(), direction: at.unproject(camera).sub(from).normalize().toArray() };
  }

  /** Ray through the middle of the picture. */
  middle(): { origin: Vec3; direction: Vec3 } {
    const box = this.canvas.getBoundingClientRect();
    return this.ray(box.left + 0.5 * box.width, box.top + 0.5 * box.height);
  }

  /** Direction from the middle of the body towards the eye. */
  towardsEye(): Vec3 {
    return eye({ ...this.orbit, distance: 1 }, [0, 0, 0], 1);
  }

  /** Place where a point appears, in pixels of the canvas; null behind the eye. */
  project(point: Vec3): { x: number; y: number } | null {
    const p = new Vector3(...point).project(this.camera);
    if (p.z > 1) return null;
    return { x: 0.5 * (p.x + 1) * this.canvas.clientWidth, y: 0.5 * (1 - p.y) * this.canvas.clientHeight };
  }

  /** Write the view of the picture into the page, for programs that read the page: degrees, and radii of the body. */
  private tell(): void {
    const { azimuth, elevation, distance } = this.taken;
    const degrees = (angle: number): string => ((angle * 180) / Math.PI).toFixed(1);
    this.canvas.dataset["view"] = `${degrees(azimuth)} ${degrees(elevation)} ${distance.toFixed(2)}`;
    this.canvas.dataset["lift"] = String(this.moved.y);
    this.canvas.dataset["lean"] = degrees(this.leaning?.angle ?? 0);
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
    const pixels = (0.5 * height) / (away * Math.tan((0.5 * this.camera.fov * Math.PI) / 180)); // per metre
    this.moved = { x: this.aside * pixels, y: this.lift };
    this.camera.setViewOffset(width, height, -this.moved.x, this.moved.y, width, height);
    this.straight.copy(this.camera, false);
    this.straight.updateMatrixWorld();
    this.leaning?.apply(this.camera, this.straight);
    // The light comes over the viewer's left shoulder, so that dents show from every side.
    const light = eye({ azimuth: this.orbit.azimuth - 1.05, elevation: 0.72, distance: 6 }, this.center, this.radius);
    this.key.position.set(...light);
    this.key.target.position.set(...this.center);
    this.placed(this.camera);
  }

  private async defer(context: WebGL2RenderingContext): Promise<void> {
    const { DeferredPicture } = await import("./graphics/deferred_picture");
    if (this.gone) return;
    this.deferred = new DeferredPicture(this.renderer, context);
    this.touch();
  }

  private resize(): void {
    const host = this.canvas.parentElement;
    if (host === null) return;
    this.sizeDue = this.deferred?.drawing === true;
    if (this.sizeDue) return;
    const width = Math.max(1, host.clientWidth);
    const height = Math.max(1, host.clientHeight);
    this.renderer.setPixelRatio(this.pace.ratio);
    this.renderer.setSize(width, height);
    this.deferred?.resized();
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.touch();
  }
}

/** Pixels of the display per pixel of the window, limited because nobody sees more of them on a soft surface. */
function finest(): number {
  return Math.min(window.devicePixelRatio, 2);
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
