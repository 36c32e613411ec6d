/** Makes a canvas as sharp as the screen, and gives the page's colours for drawing. */

/** Present colours of the page, which depend on the colour scheme. */
export interface Inks {
  readonly text: string;
  readonly faint: string;
  readonly get: (name: string) => string;
}

export function inks(from: Element): Inks {
  const style = getComputedStyle(from);
  const get = (name: string): string => (name.startsWith("--") ? style.getPropertyValue(name).trim() : name);
  return { text: get("--ink-2"), faint: get("--line"), get };
}

/** Make the canvas as sharp as the screen; its drawing units are CSS pixels. */
export function sharpen(canvas: HTMLCanvasElement, width: number, height: number): CanvasRenderingContext2D | null {
  const ratio = Math.min(window.devicePixelRatio, 2);
  const w = Math.round(width * ratio);
  const h = Math.round(height * ratio);
  if (canvas.width !== w) canvas.width = w;
  if (canvas.height !== h) canvas.height = h;
  const context = canvas.getContext("2d");
  context?.setTransform(ratio, 0, 0, ratio, 0, 0);
  return context;
}
