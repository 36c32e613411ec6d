/** A QR code as a picture without markup. */

import { encode } from "uqr";

const SVG = "http://www.w3.org/2000/svg";
const BORDER = 4; // modules of white round it, as ISO/IEC 18004 asks for

/** One path of all dark modules, each a square of 1 in a picture of `size`. */
export function qrPath(text: string): { readonly path: string; readonly size: number } {
  const { data, size } = encode(text, { ecc: "M", border: BORDER });
  const rows = data.map((row, y) => row.map((dark, x) => (dark ? `M${x} ${y}h1v1h-1z` : "")).join(""));
  return { path: rows.join(""), size };
}

/** The QR code, dark on white in every theme, because many cameras read nothing else. */
export function qrPicture(text: string): SVGSVGElement {
  const { path, size } = qrPath(text);
  const svg = document.createElementNS(SVG, "svg");
  svg.setAttribute("viewBox", `0 0 ${size} ${size}`);
  svg.setAttribute("class", "share-qr");
  svg.setAttribute("role", "img");
  svg.setAttribute("aria-label", `QR code of ${text}`);
  svg.setAttribute("width", "240");
  svg.setAttribute("shape-rendering", "crispEdges");
  for (const [fill, d] of [["#fff", `M0 0h${size}v${size}H0z`], ["#000", path]] as const) {
    const part = document.createElementNS(SVG, "path");
    part.setAttribute("fill", fill);
    part.setAttribute("d", d);
    svg.append(part);
  }
  return svg;
}
