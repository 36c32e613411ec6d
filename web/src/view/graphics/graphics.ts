/** A canvas to draw on, and whether the processor draws it. */

import { isSoftware } from "./frame_pace";

/** A canvas's graphics, and whether the processor draws them, which the hand's loop needs too. */
export interface Graphics {
  readonly canvas: HTMLCanvasElement;
  readonly context: WebGL2RenderingContext;
  readonly software: boolean;
}

/** Open the graphics; null without WebGL. Tried before three.js does, which would fill the console with errors. */
export function openGraphics(): Graphics | null {
  const plain = openContext({ antialias: false });
  if (plain === null || isSoftware(rendererOf(plain.context))) return plain && { ...plain, software: true };
  // A browser that hides or changes the renderer's name may still report that it is slow.
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

/** Name of the renderer, as its driver reports it. */
function rendererOf(context: WebGL2RenderingContext): string {
  const names = context.getExtension("WEBGL_debug_renderer_info");
  return String(context.getParameter(names?.UNMASKED_RENDERER_WEBGL ?? context.RENDERER));
}
