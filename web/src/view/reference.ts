/** Outlines of familiar things, to show beside an object. */

import { DoubleSide, Group, Mesh, MeshBasicMaterial, Path, Shape, ShapeGeometry } from "three";

/** A thing in metres that stands on its origin in the plane z = 0, with equal width to the left and the right. */
export interface Reference {
  readonly root: Group;
  /** Width of the thing [m]. */
  readonly width: number;
  readonly height: number;
  /** Words for the thing, such as "a hand, 18 cm". */
  readonly words: string;
  dispose(): void;
}

/** A stroke with round ends: from x, y to x, y, and half its width [m]. */
type Stroke = readonly [number, number, number, number, number];

interface Outline {
  readonly words: string;
  /** Longest side of an object up to which the thing is shown [m]. */
  readonly upTo: number;
  readonly strokes: readonly Stroke[];
}

const GREY = 0x8b93a3;
const OUTLINES: readonly Outline[] = [
  { words: "the tip of a finger, 1.6 cm wide", upTo: 0.04, strokes: [[0, 0, 0, 0.022, 0.008]] },
  {
    words: "a hand, 18 cm",
    upTo: 0.9,
    strokes: [
      [0, 0.026, 0, 0.05, 0.026], [0, 0.05, 0, 0.062, 0.04], [-0.035, 0.045, -0.066, 0.092, 0.0105],
      [-0.029, 0.085, -0.034, 0.155, 0.0085], [-0.01, 0.09, -0.01, 0.1712, 0.0088],
      [0.01, 0.088, 0.014, 0.16, 0.0085], [0.029, 0.08, 0.037, 0.133, 0.0075],
    ],
  },
  {
    words: "a person, 1.7 m",
    upTo: Infinity,
    strokes: [
      [0, 1.575, 0, 1.595, 0.105], [0, 1.38, 0, 1.5, 0.055], [-0.13, 1.33, 0.13, 1.33, 0.075],
      [0, 0.9, 0, 1.3, 0.165], [-0.1, 0.06, -0.09, 0.9, 0.075], [0.1, 0.06, 0.09, 0.9, 0.075],
      [-0.19, 1.33, -0.27, 0.78, 0.048], [0.19, 1.33, 0.27, 0.78, 0.048],
    ],
  },
];

/** Outline of the thing to show beside an object with this longest side [m]. */
export function outlineFor(longest: number): Outline {
  return OUTLINES.find(({ upTo }) => longest <= upTo) ?? (OUTLINES.at(-1) as Outline);
}

export function referenceFor(longest: number): Reference {
  const { words, strokes } = outlineFor(longest);
  const material = new MeshBasicMaterial({ color: GREY, side: DoubleSide, toneMapped: false });
  const parts = strokes.map((stroke) => new Mesh(new ShapeGeometry(shapeOf(stroke), 12), material));
  const root = new Group();
  const left = Math.min(...strokes.map(([x0, , x1, , r]) => Math.min(x0, x1) - r));
  const right = Math.max(...strokes.map(([x0, , x1, , r]) => Math.max(x0, x1) + r));
  for (const part of parts) part.position.x = -0.5 * (left + right);
  root.add(...parts);
  const height = Math.max(...strokes.map(([, y0, , y1, r]) => Math.max(y0, y1) + r));
  return {
    root,
    width: right - left,
    height,
    words,
    dispose: () => {
      for (const part of parts) part.geometry.dispose();
      material.dispose();
    },
  };
}

function shapeOf([x0, y0, x1, y1, r]: Stroke): Shape {
  const along = Math.atan2(y1 - y0, x1 - x0);
  const outline = new Path();
  outline.absarc(x1, y1, r, along - Math.PI / 2, along + Math.PI / 2, false);
  outline.absarc(x0, y0, r, along + Math.PI / 2, along + (3 * Math.PI) / 2, false);
  return new Shape(outline.getPoints(10));
}
