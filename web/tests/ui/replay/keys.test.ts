import { expect, test } from "vitest";
import { replayActionOf } from "../../../src/ui/replay/keys";

const key = (name: string, shiftKey = false): Parameters<typeof replayActionOf>[0] => ({ key: name, shiftKey, ctrlKey: false, metaKey: false, altKey: false });
const FIELD = { tagName: "INPUT", type: "text" };

test("keys that jump between moments are those of a session only", () => {
  expect(replayActionOf(key("n"), null)).toBeNull();
  expect(replayActionOf(key("n"), null, true)).toBe("next");
  expect(replayActionOf(key("N", true), null, true)).toBe("previous");
  expect(replayActionOf(key("n"), FIELD, true)).toBeNull();
});

test("keys that would touch, point, tour or go back to live do nothing where there is no room", () => {
  for (const name of ["t", "T", "g", "b", "p", "v", "[", "]", ",", ".", "Escape"]) expect(replayActionOf(key(name), null, true), name).toBe("none");
  expect(replayActionOf(key("Escape"), null)).toBe("live");
  expect(replayActionOf(key("t"), null)).toBeNull();
});

test("a session is played and stepped by the keys of the last minute", () => {
  for (const name of [" ", "ArrowLeft", "ArrowRight", "Home", "End"]) expect(replayActionOf(key(name), null, true)).toBe(replayActionOf(key(name), null));
});
