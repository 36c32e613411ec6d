/** A canvas to draw on, and by what it is drawn. */

import { isSoftware } from "./frame_pace";

/** A canvas's graphics, and whether the processor draws them, which the hand's loop needs too. */
export interface Graphics {
  readonly canvas: HTMLCanvasElement;
  readonly context: WebGL2RenderingContext;
  readonly software: boolean;
}

/** Null without WebGL. Asked for before three.js does, which would fill the console where there are none. */
export function openGraphics(): Graphics | null {
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
