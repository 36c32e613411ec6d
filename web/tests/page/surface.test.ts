/** Refinement, normals, picking, colours: what is drawn is what came. */

import { describe, expect, it } from "vitest";
import { norm, row, type Vec3 } from "../../src/model/vec";
import {
  colourAt,
  DISPLACEMENT,
  luminance,
  parseHex,
  STIFFNESS,
  table,
  toLinear,
  userColour,
} from "../../src/model/colours";
import { alongNormals, vertexNormals } from "../../src/view/body/normals";
import { place, Refiner, split } from "../../src/view/body/refine";
import { StiffnessMap } from "../../src/view/body/stiffness_map";
import { at, pick, placeTowards } from "../../src/view/pointing/pick";

const OCTAHEDRON = {
  vertices: Float32Array.from([1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1]),
  faces: Uint32Array.from([0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4, 2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5]),
};

/** A sphere of radius 1, `times` splits from an octahedron. */
function sphere(times: number): { vertices: Float32Array; faces: Uint32Array } {
  let { vertices, faces }: { vertices: Float32Array; faces: Uint32Array } = OCTAHEDRON;
  for (let k = 0; k < times; k++) {
    const how = split(vertices.length / 3, faces);
    const out = new Float32Array(3 * how.coarse + 1.5 * how.edges.length);
    place(how, vertices, new Float32Array(vertices.length), out);
    for (let i = 0; i < out.length; i += 3) {
      const length = norm(row(out, i / 3));
      for (let c = i; c < i + 3; c++) out[c] = (out[c] ?? 0) / length;
    }
    vertices = out;
    faces = how.faces;
  }
  return { vertices, faces };
}

describe("splitting", () => {
  it("gives each edge one middle and each face four", () => {
    const how = split(6, OCTAHEDRON.faces);
    expect(how.edges.length / 2).toBe(12);
    expect(how.faces.length).toBe(4 * OCTAHEDRON.faces.length);
    expect(Math.max(...how.faces)).toBe(17);
  });

  it("keeps the sense of faces: the surface stays closed, each edge run once in each direction", () => {
    const { faces } = split(6, OCTAHEDRON.faces);
    const runs = new Set<string>();
    for (let f = 0; f < faces.length; f += 3) {
      for (let k = 0; k < 3; k++) runs.add(`${faces[f + k] ?? 0} ${faces[f + ((k + 1) % 3)] ?? 0}`);
    }
    expect(runs.size).toBe(faces.length);
    for (const run of runs) expect(runs.has(run.split(" ").reverse().join(" "))).toBe(true);
  });
});

describe("refining", () => {
  it("is thirty times nearer to a sphere than the facets that came", () => {
    const { vertices, faces } = sphere(3);
    const refiner = new Refiner(vertices.length / 3, faces, 4200);
    refiner.run(vertices);
    expect(refiner.positions.length).toBeGreaterThan(3 * vertices.length);
    let facets = 0;
    for (let f = 0; f < faces.length / 3; f++) {
      facets = Math.max(facets, 1 - norm(at(vertices, faces, { face: f, shares: [1 / 3, 1 / 3, 1 / 3] })));
    }
    let off = 0;
    for (let i = 0; i < refiner.positions.length / 3; i++) off = Math.max(off, Math.abs(norm(row(refiner.positions, i)) - 1));
    expect(off).toBeLessThan(facets / 30);
  });

  it("leaves the vertices that came where they are", () => {
    const { vertices, faces } = sphere(2);
    const refiner = new Refiner(vertices.length / 3, faces);
    refiner.run(vertices);
    expect(refiner.positions.slice(0, vertices.length)).toEqual(vertices);
  });

  it("does not bend a plane", () => {
    const flat = Float32Array.from([0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0]);
    const refiner = new Refiner(4, Uint32Array.from([0, 1, 2, 2, 1, 3]));
    refiner.run(flat);
    for (let i = 2; i < refiner.positions.length; i += 3) expect(refiner.positions[i]).toBe(0);
  });

  it("keeps the edges of a body: a right angle is no bend", () => {
    const how = split(2, new Uint32Array());
    const edge = { ...how, edges: Uint32Array.from([0, 1]) };
    const out = new Float32Array(9);
    place(edge, Float32Array.from([0, 0, 0, 1, 0, 1]), Float32Array.from([0, 0, 1, 1, 0, 0]), out);
    expect([...out.slice(6)]).toEqual([0.5, 0, 0.5]);
  });

  it("stops where the picture would have too many vertices", () => {
    const { vertices, faces } = sphere(3);
    expect(new Refiner(vertices.length / 3, faces, 100).faces).toBe(faces);
  });
});

describe("normals", () => {
  it("of a sphere point outwards, exactly", () => {
    const { vertices, faces } = sphere(3);
    const normals = vertexNormals(vertices, faces);
    for (let i = 0; i < vertices.length / 3; i++) {
      const [n, v] = [row(normals, i), row(vertices, i)];
      expect(n[0] * v[0] + n[1] * v[1] + n[2] * v[2]).toBeGreaterThan(1 - 1e-6);
    }
  });

  it("measure a dent as negative, and the largest magnitude", () => {
    const rest = Float32Array.from([0, 0, 1, 1, 0, 0]);
    const now = Float32Array.from([0, 0, 0.98, 1.01, 0, 0]);
    const out = new Float32Array(2);
    const most = alongNormals(now, rest, rest, out);
    expect(out[0]).toBeCloseTo(-0.02, 6);
    expect(out[1]).toBeCloseTo(0.01, 6);
    expect(most).toBeCloseTo(0.02, 6);
  });
});

describe("picking", () => {
  const { vertices, faces } = sphere(2);

  it("finds the front side and not the back", () => {
    const hit = pick(vertices, faces, [0.1, -5, 0.05], [0, 1, 0]);
    expect(hit?.point[1]).toBeLessThan(-0.9);
    expect(hit?.distance).toBeCloseTo(5 + (hit?.point[1] ?? 0), 5);
  });

  it("misses beside the body, and behind the eye", () => {
    expect(pick(vertices, faces, [2, -5, 0], [0, 1, 0])).toBeNull();
    expect(pick(vertices, faces, [0.1, 5, 0.05], [0, 1, 0])).toBeNull();
  });

  it("gives shares that lead back to the point, and follow the surface as it moves", () => {
    const hit = pick(vertices, faces, [0.2, -5, 0.3], [0, 1, 0]);
    if (hit === null) throw new Error("the ray must hit");
    const back = at(vertices, faces, hit);
    for (let k = 0; k < 3; k++) expect(back[k]).toBeCloseTo(hit.point[k] ?? 0, 6);
    const twice = at(vertices.map((x) => 2 * x), faces, hit);
    expect(twice[1]).toBeCloseTo(2 * hit.point[1], 5);
  });

  it("finds the place that looks in a direction", () => {
    const direction: Vec3 = [0.6, -0.8, 0];
    const found = placeTowards(vertices, faces, [0, 0, 0], direction, 1);
    if (found === null) throw new Error("a closed body has such a place");
    const p = at(vertices, faces, found);
    expect((p[0] * direction[0] + p[1] * direction[1]) / norm(p)).toBeGreaterThan(0.999);
  });
});

describe("colours", () => {
  it("of stiffness get brighter from soft to stiff", () => {
    let before = -1;
    for (let i = 0; i <= 50; i++) {
      const now = luminance(colourAt(STIFFNESS, i / 50));
      expect(now).toBeGreaterThan(before);
      before = now;
    }
  });

  it("of displacement are told apart by the two ends, rest between them", () => {
    const light = DISPLACEMENT.light;
    const [inward, outward] = [colourAt(light, 0.1), colourAt(light, 0.9)];
    expect(inward[2]).toBeGreaterThan(inward[0]);
    expect(outward[0]).toBeGreaterThan(outward[2]);
    expect(luminance(colourAt(light, 0.5))).toBeGreaterThan(Math.max(luminance(inward), luminance(outward)));
  });

  it("beyond the ends stay at the ends, and nothing is no colour of its own", () => {
    expect(colourAt(STIFFNESS, 7)).toEqual(colourAt(STIFFNESS, 1));
    expect(colourAt(STIFFNESS, Number.NaN)).toEqual(colourAt(STIFFNESS, 0));
  });

  it("become linear light in the table", () => {
    const t = table(STIFFNESS, 2);
    expect(t[0]).toBeCloseTo(toLinear(parseHex("#00224e")[0]), 6);
    expect(t[5]).toBeCloseTo(toLinear(parseHex("#fee838")[2]), 6);
  });

  it("of eight users in a row differ, by day and by night", () => {
    for (const scheme of ["light", "dark"] as const) {
      expect(new Set([1, 2, 3, 4, 5, 6, 7, 8].map((u) => userColour(u, scheme))).size).toBe(8);
    }
  });
});

describe("the map of stiffness", () => {
  it("knows what was touched and nothing else", () => {
    const map = new StiffnessMap(Float32Array.from([0, 0, 0, 1, 0, 0]));
    expect(map.empty).toBe(true);
    expect(map.add([0, 0, 0], 250, 0.2)).toBe(true);
    expect([...map.values]).toEqual([250, 0]);
    expect([...map.known]).toEqual([1, 0]);
    expect(map.low).toBe(250);
  });

  it("comes to rest when the same is found again", () => {
    const map = new StiffnessMap(Float32Array.from([0, 0, 0]));
    map.add([0, 0, 0], 250, 0.2);
    expect(map.add([0, 0, 0], 250, 0.2)).toBe(false);
    expect(map.add([0, 0, 0], 500, 0.2)).toBe(true);
    for (let i = 0; i < 40; i++) map.add([0, 0, 0], 500, 0.2);
    expect(map.values[0]).toBeCloseTo(500, 0);
  });

  it("leaves out what is no stiffness", () => {
    const map = new StiffnessMap(new Float32Array(3));
    expect(map.add([0, 0, 0], Infinity, 1)).toBe(false);
    expect(map.add([0, 0, 0], 0, 1)).toBe(false);
    expect(map.empty).toBe(true);
  });
});
