/** Pictures on buttons, drawn with one pen on a square of 20. */

const SVG = "http://www.w3.org/2000/svg";

const PATHS = {
  reset: "M4.5 8.2a6 6 0 1 1-.3 3.4M4.2 4.2v4.2h4.2",
  full: "M3.5 7V3.5H7M13 3.5h3.5V7M16.5 13v3.5H13M7 16.5H3.5V13",
  sun: "M10 6.6a3.4 3.4 0 1 0 0 6.8 3.4 3.4 0 0 0 0-6.8ZM10 1.8v2M10 16.2v2M1.8 10h2M16.2 10h2M4.2 4.2l1.4 1.4M14.4 14.4l1.4 1.4M4.2 15.8l1.4-1.4M14.4 5.6l1.4-1.4",
  help: "M7.4 7.4a2.7 2.7 0 1 1 4 2.4c-.9.5-1.4 1-1.4 2.1M10 14.8v.1M10 2.4a7.6 7.6 0 1 0 0 15.2 7.6 7.6 0 0 0 0-15.2Z",
  close: "M5 5l10 10M15 5L5 15",
  panel: "M3 4h14v12H3zM12.2 4v12",
  play: "M7 4.8v10.4l8-5.2z",
  replay: "M10 6v4.2l2.8 1.8M3.6 9a6.6 6.6 0 1 1 .5 3.6M3.4 4.6V9h4.4",
  upload: "M10 13.2V3.4M6.4 6.8 10 3.2l3.6 3.6M3.6 12.6v3.8h12.8v-3.8",
  chevron: "M6 8l4 4 4-4",
  gamepad: "M6.4 5.6h7.2a4 4 0 0 1 3.9 3.2l.9 4.4a1.9 1.9 0 0 1-3.4 1.4l-1.6-2.2H6.6L5 14.6a1.9 1.9 0 0 1-3.4-1.4l.9-4.4a4 4 0 0 1 3.9-3.2ZM6.8 7.6v2.8M5.4 9h2.8M13 8.2v.1M14.4 9.8v.1",
  touch: "M10 2.6v9M6.6 8.4L10 11.8l3.4-3.4M2.6 11.4c1.6 0 2.6 1.1 3.4 2.7.8 1.7 2 2.7 4 2.7s3.2-1 4-2.7c.8-1.6 1.8-2.7 3.4-2.7",
} as const;

export type IconName = keyof typeof PATHS;

/** @param picture Name of a picture, or its strokes, for a picture whose code is loaded later than the page. */
export function icon(picture: IconName | `M${string}`): SVGSVGElement {
  const svg = document.createElementNS(SVG, "svg");
  svg.setAttribute("viewBox", "0 0 20 20");
  svg.setAttribute("class", "icon");
  svg.setAttribute("aria-hidden", "true");
  const path = document.createElementNS(SVG, "path");
  path.setAttribute("d", (PATHS as Readonly<Record<string, string>>)[picture] ?? picture);
  svg.append(path);
  return svg;
}
