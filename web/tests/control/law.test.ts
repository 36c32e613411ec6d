import { describe, expect, test } from "vitest";
import { blend, difference, type LocalSurface, look, shift, type Sight } from "../../src/control/geometry";
import { type Gains, type LawSettings, localForce, pressedDepth } from "../../src/control/law";
import { AT_REST } from "../../src/control/proportional_integral";
import type { LawName } from "../../src/model/laws";
import type { Vec3 } from "../../src/model/vec";
import { expectClose } from "../close";
import { vectors } from "../vectors";

interface LawVectors {
  surfaces: {
    surface: LocalSurface;
    probe: Vec3;
    sight: Sight;
    other: Sight;
    share: number;
    blend: Sight;
    shift: Sight;
  }[];
  presses: {
    law: LawName;
    gains: Gains;
    settings: LawSettings;
    steps: {
      sight: Sight;
      dt: number;
      moved_in: number;
      most: number;
      pressed_depth: number;
      memory: object;
      force: object;
    }[];
  }[];
}

const { surfaces, presses } = vectors("law") as LawVectors;

describe("as the Python client", () => {
  test("a probe sees a plane and a sphere", () => {
    surfaces.forEach((v, i) => {
      const seen = look(v.surface, v.probe);
      expectClose(seen, v.sight, `sight ${i}`);
      expectClose(blend(seen, v.other, v.share), v.blend, `blend ${i}`);
      expectClose(shift(seen, difference(v.other, seen)), v.shift, `shift ${i}`);
    });
  });

  test.each(presses)("$law with $gains presses, rests and lets go", ({ law, gains, settings, steps }) => {
    let memory = AT_REST;
    steps.forEach((v, i) => {
      const [after, force] = localForce(law, memory, v.sight, gains, v.dt, settings, v.moved_in, v.most);
      memory = after;
      expectClose(memory, v.memory, `memory ${i}`);
      expectClose(force, v.force, `force ${i}`);
      expectClose(pressedDepth(law, v.sight), v.pressed_depth, `depth ${i}`);
    });
  });
});

test("the ends of a blend are the sights themselves, and no shift leaves one as it is", () => {
  for (const { sight, other } of surfaces) {
    expect(blend(sight, other, 0)).toBe(sight);
    expect(blend(sight, other, 1)).toBe(other);
    expect(shift(sight, null)).toBe(sight);
  }
});
