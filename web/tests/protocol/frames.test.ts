import { zlibSync } from "fflate";
import { describe, expect, test } from "vitest";
import { encodeAck } from "../../src/protocol/ack";
import { type ContactSample, decodeContactSample, encodeContactSample } from "../../src/protocol/contact_sample";
import { ProtocolError } from "../../src/protocol/frame";
import { decodePatch, type Patch } from "../../src/protocol/patch";
import { decodeRestMesh } from "../../src/protocol/rest_mesh";
import { decodeScene, type Scene } from "../../src/protocol/scene";
import { traversalOf } from "../../src/protocol/traversal";
import { type BinaryVector, fromHex, oneByteWrong, outcome, toHex, vectors, wrongLengths } from "../vectors";

const told = vectors("contact_sample") as BinaryVector<ContactSample>[];
/** The page tells a deflection only with the hand that it simulates. */
const deflections = told.filter(({ fields }) => fields.deflection !== null && fields.own_model === null);
const samples = told.filter((sample) => !deflections.includes(sample));
/** The page moves no models of hands, and its patches have no partners. */
const patches = (vectors("patch") as BinaryVector<Patch & { partners?: unknown }>[])
  .filter(({ fields }) => fields.partners === null)
  .map(({ name, hex, fields }) => {
    const kept = { ...fields };
    delete kept.partners;
    return { name, hex, fields: kept };
  });
const meshes = vectors("rest_mesh") as BinaryVector<{ vertices: number[][]; faces: number[][] }>[];

const quantised = vectors("quantised_mesh") as BinaryVector<{
  low: number[];
  unit: number[];
  vertices: number[][];
  faces: number[][];
}>[];

interface SceneFields extends Omit<Scene, "surface"> {
  readonly surface: { readonly scale: number; readonly units: number[][] } | null;
}
const scenes = vectors("scene") as BinaryVector<SceneFields>[];
const acks = vectors("ack") as BinaryVector<{ tick: number; wants: 0 | 1 }>[];
const traversals = vectors("traversal") as {
  name: string;
  vertices: number;
  faces: number[][];
  order: number[];
  p: number[];
  q: number[];
  r: number[];
}[];
/** Of the rest mesh that the written scenes are of. */
const OCTAHEDRON = traversals.find(({ name }) => name === "octahedron");
const TRAVERSAL = traversalOf(OCTAHEDRON?.vertices ?? 0, Uint32Array.from(OCTAHEDRON?.faces.flat() ?? []));

describe("golden vectors", () => {
  test.each(samples)("contact_sample $name", ({ hex, fields }) => {
    expect(decodeContactSample(fromHex(hex))).toEqual(fields);
    expect(toHex(encodeContactSample(fields))).toBe(hex);
  });

  test.each(patches)("patch $name", ({ hex, fields }) => {
    expect(decodePatch(fromHex(hex))).toEqual(fields);
  });

  test.each(meshes)("rest_mesh $name", ({ hex, fields }) => {
    const mesh = decodeRestMesh(fromHex(hex));
    expect(Array.from(mesh.vertices)).toEqual(fields.vertices.flat());
    expect(Array.from(mesh.faces)).toEqual(fields.faces.flat());
  });
});

test.each(quantised)("golden vector of a quantised mesh: $name", ({ hex, fields }) => {
  const mesh = decodeRestMesh(fromHex(hex));
  const { low, unit } = fields;
  const places = fields.vertices.flatMap((z) => z.map((steps, k) => (low[k] ?? NaN) + (unit[k] ?? NaN) * steps));
  expect(mesh.vertices).toEqual(Float32Array.from(places));
  expect(Array.from(mesh.faces)).toEqual(fields.faces.flat());
});

describe("golden vectors of watching", () => {
  test.each(scenes)("scene $name", ({ hex, fields }) => {
    const { surface, ...scene } = decodeScene(fromHex(hex), () => TRAVERSAL);
    expect({
      ...scene,
      surface: surface && { scale: surface.scale, units: Array.from(surface.units) },
    }).toEqual({ ...fields, surface: fields.surface && { ...fields.surface, units: fields.surface.units.flat() } });
  });

  test.each(acks)("ack $name", ({ hex, fields }) => {
    expect(toHex(encodeAck(fields.tick, fields.wants))).toBe(hex);
  });

  test.each(traversals)("traversal of $name", ({ vertices, faces, order, p, q, r }) => {
    const found = traversalOf(vertices, Uint32Array.from(faces.flat()));
    expect(Array.from(found.order)).toEqual(order);
    expect(Array.from(found.foretold)).toEqual(p.flatMap((_, k) => [p[k], q[k], r[k]]));
  });

  test("a surface of another number of vertices is refused", () => {
    const withSurface = scenes.find(({ fields }) => fields.surface !== null);
    const frame = fromHex(withSurface?.hex ?? "");
    const more = traversalOf(7, Uint32Array.from([0, 1, 2]));
    const fewer = traversalOf(5, Uint32Array.from([0, 1, 2]));
    expect(() => decodeScene(frame, () => more)).toThrow(/inflated size of a surface/);
    expect(() => decodeScene(frame, () => fewer)).toThrow(/inflated size of a surface is "more"/);
  });
});

describe("whatever the bytes, a message or a ProtocolError", () => {
  const decoders = {
    contact_sample: decodeContactSample,
    patch: decodePatch,
    rest_mesh: decodeRestMesh,
    scene: (bytes: Uint8Array): Scene => decodeScene(bytes, () => TRAVERSAL),
  };
  const all = (Object.keys(decoders) as (keyof typeof decoders)[]).flatMap((kind) =>
    (vectors(kind) as BinaryVector<unknown>[]).map(({ name, hex }) => ({ kind, name, frame: fromHex(hex) })),
  );
  for (const { name, hex } of quantised) all.push({ kind: "rest_mesh", name: `quantised ${name}`, frame: fromHex(hex) });

  test.each(all)("$kind $name of a wrong length", ({ kind, frame }) => {
    for (const bytes of wrongLengths(frame)) expect(outcome(decoders[kind], bytes)).toBe("ProtocolError");
  });

  test.each(all)("$kind $name with one byte wrong", ({ kind, frame }) => {
    for (const bytes of oneByteWrong(frame)) {
      expect(["decoded", "ProtocolError"]).toContain(outcome(decoders[kind], bytes));
    }
  });
});

test("frames for clients that move models of hands are refused by name", () => {
  const known = patches.map(({ name }) => name);
  const others = (vectors("patch") as BinaryVector<unknown>[]).filter(({ name }) => !known.includes(name));
  expect(Math.min(others.length, deflections.length)).toBeGreaterThan(0);
  for (const { hex } of others) expect(() => decodePatch(fromHex(hex))).toThrow(/flags of a patch/);
  for (const { hex } of deflections) expect(() => decodeContactSample(fromHex(hex))).toThrow(/flags of a contact sample/);
});

test("an error names the value and the limit", () => {
  const [first] = samples;
  if (first === undefined) throw new Error("no vectors");
  const wrong = { ...first.fields, force: [0, 101, 0] as const };
  expect(() => encodeContactSample(wrong)).toThrow("length of force is \"101.0 N\"; expected <= 100 N");
  const other = fromHex(first.hex);
  other[0] = 9;
  expect(() => decodeContactSample(other)).toThrow(new ProtocolError("frame's protocol version", 9, "6"));
});

const TINY = 0.99e-6; // m/N, stiffer than anything
test.each([
  ["tick of a patch", 4, 0, "u32"],
  ["sample_wait", 28, -1, "f32"],
  ["length of x_free", 32, 11, "f32"],
  ["length of normal", 44, 1.01, "f32"],
  ["length of normal", 44, 0.99, "f32"],
  ["curvature", 56, Infinity, "f32"],
  ["curvature", 56, -1.1e4, "f32"],
  ["c_ii", 60, 0, "f32"],
  ["c_ii", 60, TINY, "f32"],
  ["c_ii", 60, 11, "f32"],
  ["k_h", 64, NaN, "f32"],
  ["integral_gain", 68, 2e9, "f32"],
  ["length of own_force", 72, 101, "f32"],
  ["u_others", 88, NaN, "f32"],
  ["length of u_others", 84, -11, "f32"],
  ["lag of the room", 96, 61, "f32"],
  ["lag of the room", 96, -1, "f32"],
  ["coupling of the room", 100, 0x6400, "u16"], // 1,024
  ["margin of the room", 102, 0xbc00, "u16"], // -1
  ["margin of the room", 102, 0x7e00, "u16"], // no number
  ["geometry of a frame", 2, 0x30, "u16"],
  ["law of a frame", 2, 0xf1, "u16"],
  ["flags of a patch", 2, 0x0231, "u16"],
])("a patch with a wrong %s is refused", (field, offset, value, type) => {
  const frame = fromHex(patches[0]?.hex ?? "");
  const view = new DataView(frame.buffer);
  if (type === "u32") view.setUint32(offset, value, true);
  else if (type === "u16") view.setUint16(offset, value, true);
  else view.setFloat32(offset, value, true);
  expect(() => decodePatch(frame)).toThrow(new RegExp(`^${field} is `));
});

test("a contact on a fixed part has the least compliance, and a room without coupling no edge", () => {
  const frame = fromHex(patches[0]?.hex ?? "");
  const view = new DataView(frame.buffer);
  view.setFloat32(60, 1e-6, true);
  view.setUint16(102, 0x7c00, true);
  const patch = decodePatch(frame);
  expect(patch.c_ii).toBeCloseTo(1e-6, 12);
  expect(patch.room.margin).toBe(Infinity);
});

test.each([
  ["flags of a rest mesh is 2", 2, 2, "u16"],
  ["vertices of a rest mesh is 4294967295", 4, 2 ** 32 - 1, "u32"],
  ["faces of a rest mesh is 131071", 8, 131_071, "u32"],
  ["inflated size of a rest mesh is 48; expected 54 bytes", 8, 5, "u32"],
  ["inflated size of a rest mesh is \"more\"; expected 42 bytes", 4, 3, "u32"],
  ["low end of a mesh's box is -11", 12, -11, "f32"],
  ["low end of a mesh's box is NaN", 16, NaN, "f32"],
  ["size of a mesh's box is 65535", 24, 1, "f32"],
  ["size of a mesh's box is -", 28, -1e-9, "f32"],
  ["size of a mesh's box is NaN", 32, NaN, "f32"],
] as const)("a quantised mesh that lies is refused: %s", (said, offset, value, type) => {
  const frame = fromHex(quantised[0]?.hex ?? "");
  const view = new DataView(frame.buffer);
  if (type === "u16") view.setUint16(offset, value, true);
  else if (type === "u32") view.setUint32(offset, value, true);
  else view.setFloat32(offset, value, true);
  expect(() => decodeRestMesh(frame)).toThrow(said);
});

test.each([
  ["corner of a face is 65535; expected from 0 to 3", 255],
  ["face of a quantised mesh is \"0, 0, 0\"; expected three corners", 0],
])("faces of a quantised mesh are checked before anything is made of them: %s", (said, byte) => {
  const frame = fromHex(quantised[0]?.hex ?? "");
  const stream = zlibSync(new Uint8Array(6 * (4 + 4)).fill(byte));
  const bytes = new Uint8Array(36 + stream.length);
  bytes.set(frame.subarray(0, 36));
  bytes.set(stream, 36);
  expect(() => decodeRestMesh(bytes)).toThrow(said);
});

test("a mesh that inflates to more, or to something else, is refused before it is kept", () => {
  const [first] = meshes;
  if (first === undefined) throw new Error("no vectors");
  const frame = fromHex(first.hex);
  const fewer = frame.slice();
  fewer[8] = 3; // faces
  expect(() => decodeRestMesh(fewer)).toThrow(/inflated size of a rest mesh is "more"/);
  const spoilt = frame.slice();
  const last = spoilt.length - 1;
  spoilt[last] = (spoilt[last] ?? 0) ^ 1;
  expect(() => decodeRestMesh(spoilt)).toThrow(/checksum/);
});
