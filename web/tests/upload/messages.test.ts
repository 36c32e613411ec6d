import { describe, expect, test } from "vitest";
import { ProtocolError } from "../../src/protocol/frame";
import { decodeUploadAnswer, encodeUploadRequest } from "../../src/upload/messages";

describe("an answer of the server", () => {
  test.each([
    { type: "upload_offer", kinds: [".stl"], max_bytes: 10, max_memory: 20, max_seconds: 3.5 },
    { type: "examined", findings: [{ problem: "p", remedy: "r" }], fix: "z < 5%", scale: 0.001, triangles: 12, middle: [5e5, 0, -0.5] },
    { type: "refused", about: "size", message: "too small", tries: 3 },
    { type: "progress", phase: "factoring", share: 0.5 },
    { type: "prepared", command: "cohaptic serve" },
    { type: "error", code: 4422, field: "", message: "no" },
  ])("$type is read as it was written", (answer) => {
    expect(decodeUploadAnswer(JSON.stringify(answer))).toEqual(answer);
  });

  test.each([
    "{",
    "[]",
    '{"type":"dance"}',
    '{"type":"progress","phase":"x","share":2}',
    '{"type":"progress","phase":"x","share":null}',
    '{"type":"prepared","command":"x","more":1}',
    '{"type":"examined","findings":[1],"fix":"","scale":1,"triangles":1}',
    '{"type":"refused","about":"taste","message":"x","tries":1}',
    '{"type":"examined","findings":[],"fix":"","scale":0,"triangles":1}',
    `"${"x".repeat(30_000)}"`,
  ])("%s is refused", (text) => {
    expect(() => decodeUploadAnswer(text)).toThrow(ProtocolError);
  });
});

test("a request is what the server reads", () => {
  const text = encodeUploadRequest({ type: "prepare_object", fix: "z < 5%", scale: 0.01, young: 6e3, poisson: 0.45 });
  expect(JSON.parse(text)).toEqual({ type: "prepare_object", fix: "z < 5%", scale: 0.01, young: 6000, poisson: 0.45 });
  const felt = encodeUploadRequest({ type: "prepare_object", fix: "z < 5%", scale: 0.01, young: null, poisson: 0.45 });
  expect(JSON.parse(felt)).toMatchObject({ young: null });
});
