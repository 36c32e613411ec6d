import { describe, expect, it } from "vitest";
import { norm, row } from "../../../src/model/vec";
import { place, Refiner, split } from "../../../src/view/body/refine";
import { at } from "../../../src/view/pointing/pick";
import { OCTAHEDRON, sphere } from "../shapes";

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
