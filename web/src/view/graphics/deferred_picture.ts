/**
 * A picture that is drawn beside the canvas, and put on it once it is finished.
 *
 * Where the processor draws, the browser reads every picture back from the canvas to show it, and the page
 * waits meanwhile: for the copy, and before that for all that is not drawn yet. So nothing is on the canvas
 * that is not drawn, and the page waits for the copy alone.
 */

import { SRGBColorSpace, type WebGLRenderer, WebGLRenderTarget } from "three";

/** Of a picture whose end nobody tells: it is shown then, as far as it is [s]. */
const LONGEST = 2;

export class DeferredPicture {
  private readonly target: WebGLRenderTarget;
  private readonly gl: WebGL2RenderingContext;
  /** Passed once the picture is drawn; null where none is being drawn. */
  private fence: WebGLSync | null = null;
  private waited = 0;

  constructor(private readonly renderer: WebGLRenderer, context: WebGL2RenderingContext) {
    this.gl = context;
    this.target = new WebGLRenderTarget(1, 1, { colorSpace: SRGBColorSpace, generateMipmaps: false });
    // Bytes, as the canvas has them: three.js encodes the colours, and the graphics may not do so again.
    this.target.texture.internalFormat = "RGBA8";
    // What three.js calls a target that people see as it is: with the canvas's tone mapping and colours.
    Object.assign(this.target, { isXRRenderTarget: true });
  }

  /** Whether one is being drawn. */
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
   * Put the picture on the canvas if it is finished.
   *
   * @param dt Since the last question [s].
   * @returns Whether it is there now, and was not before.
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

  /** The last picture on a canvas of another size, until there is one for that. */
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

/** What three.js made for a target; null until it is drawn to. */
function framebufferOf(renderer: WebGLRenderer, target: WebGLRenderTarget): WebGLFramebuffer | null {
  const { __webglFramebuffer: made } = renderer.properties.get(target) as { __webglFramebuffer?: WebGLFramebuffer };
  return made ?? null;
}
