import { expect, test } from "vitest";
import { decodeOverview } from "../../src/session/overview";
import { WATCHING } from "../watch/scenes";

const OVERVIEW = {
  name: "lab.mcap", room: "lab", first: 100, last: 160, watching: JSON.stringify(WATCHING), unshown: "", further: 2, complete: true,
  users: [{ user: 1, name: "ana" }, { user: 7, name: "ben" }],
  moments: [{ t: 140, kind: "left", user: 7, text: "ben left" }, { t: 120, kind: "mark", user: null, text: "trial 1" }],
};

test("an overview is read, with its moments in order", () => {
  const { first, last, names, moments, watching, further } = decodeOverview(JSON.stringify(OVERVIEW));
  expect([first, last, names.get(7), further]).toEqual([100, 160, "ben", 2]);
  expect(moments.map(({ t, text }) => [t, text])).toEqual([[120, "trial 1"], [140, "ben left"]]);
  expect(watching.type).toBe("watching");
});

test.each([
  ["last", 99], ["first", "100"], ["first", null], ["name", 3], ["users", {}], ["users", [3]], ["users", [{ user: "1", name: "a" }]],
  ["moments", [{ t: 120, kind: "party", user: null, text: "x" }]], ["moments", [{ t: null, kind: "mark", user: null, text: "x" }]],
  ["watching", "{}"], ["watching", JSON.stringify({ type: "error", code: 1, field: "", message: "" })], ["further", 0.5],
])("an overview whose %s is %j is refused", (key, value) => {
  expect(() => decodeOverview(JSON.stringify({ ...OVERVIEW, [key]: value }))).toThrow();
});
