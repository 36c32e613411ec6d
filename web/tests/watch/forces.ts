/** `tests/vectors/forces.json`: contacts, Green's functions and displacements as the server has them. */

import type { Vec3 } from "../../src/model/vec";
import { vectors } from "../vectors";

interface Under {
  radius: number;
  foot: Vec3;
  normal: Vec3;
  vertices: number[];
  weights: number[];
}

export interface Ring {
  along: number;
  round: number;
  radius: number;
  tube: number;
}

interface Forces {
  vertices: number[][];
  faces: number[][];
  contacts: (Under & { force: Vec3 })[];
  blocks: Record<string, string>;
  displacement: number[][];
  ring: Ring & { contacts: Under[] };
}

export const example = vectors("forces") as Forces;
