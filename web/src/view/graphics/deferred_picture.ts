/**
 * A picture that is drawn off the canvas, and copied to the canvas when it is finished.
 *
 * Where the processor draws, the browser reads every picture back from the canvas to show it. The page waits
 * meanwhile for the copy, and before that for the end of the drawing. Only finished pictures therefore come to
 * the canvas, so that the page waits for the copy alone.
 */

import { SRGBColorSpace, type WebGLRenderer, WebGLRenderTarget } from "three";

/** Longest wait for the report that a picture is finished; after it the picture is shown as it is [s]. */
const LONGEST = 2;

export class DeferredPicture {
  private readonly target: WebGLRenderTarget;
  private readonly gl: WebGL2RenderingContext;
  /** Fence that is signalled when the picture is drawn; null while none is being drawn. */
  private fence: WebGLSync | null = null;
  private waited = 0;

  constructor(private readonly renderer: WebGLRenderer, context: WebGL2RenderingContext) {
    this.gl = context;
    this.target = new WebGLRenderTarget(1, 1, { colorSpace: SRGBColorSpace, generateMipmaps: false });
    // Plain bytes like the canvas: three.js encodes the colours already, and the graphics must not do so again.
    this.target.texture.internalFormat = "RGBA8";
    // This flag makes three.js treat the target as a visible one, with the canvas's tone mapping and colours.
    Object.assign(this.target, { isXRRenderTarget: true });
  }

  /** Whether a picture is being drawn. */
  get drawing(): boolean {
    return this.fence !== null;
  }

  /** Begin a picture. */
  begin(render: () => void): void {
    const { width, height } = this.renderer.domElement;
    this.target.setSize(width, height);
    this.renderer.setRenderTarget(this.target);
    render();
    this.renderer.setRenderTarget(null);
    this.gl.deleteSync(this.fence);
    this.fence = this.gl.fenceSync(this.gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    this.waited = 0;
    this.gl.flush();
  }

  /**
   * Copy the picture to the canvas if it is finished.
   *
   * @param dt Time since the last call [s].
   * @returns Whether this call has put a new picture on the canvas.
   */
  finish(dt: number): boolean {
    if (this.fence === null) return false;
    this.waited += dt;
    const { gl } = this;
    if (gl.getSyncParameter(this.fence, gl.SYNC_STATUS) !== gl.SIGNALED && this.waited < LONGEST) return false;
    gl.deleteSync(this.fence);
    this.fence = null;
    this.show();
    return true;
  }

  /** Show the last picture on a resized canvas until there is one of the new size. */
  resized(): void {
    if (this.fence === null) this.show();
  }

  dispose(): void {
    this.gl.deleteSync(this.fence);
    this.fence = null;
    this.target.dispose();
  }

  private show(): void {
    const { gl, renderer, target } = this;
    const made = framebufferOf(renderer, target);
    if (made === null) return; // nothing was drawn yet
    const { width, height } = renderer.domElement;
    const same = width === target.width && height === target.height;
    renderer.setRenderTarget(null);
    renderer.state.bindFramebuffer(gl.READ_FRAMEBUFFER, made);
    renderer.state.bindFramebuffer(gl.DRAW_FRAMEBUFFER, null);
    gl.blitFramebuffer(
      0, 0, target.width, target.height, 0, 0, width, height, gl.COLOR_BUFFER_BIT, same ? gl.NEAREST : gl.LINEAR,
    );
    renderer.state.bindFramebuffer(gl.READ_FRAMEBUFFER, null);
  }
}

/** Framebuffer that three.js made for a target; null until something is drawn to the target. */
function framebufferOf(renderer: WebGLRenderer, target: WebGLRenderTarget): WebGLFramebuffer | null {
  const { __webglFramebuffer: made } = renderer.properties.get(target) as { __webglFramebuffer?: WebGLFramebuffer };
  return made ?? null;
}
