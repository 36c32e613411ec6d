import { describe, expect, it } from "vitest";
import { spoken } from "../../src/page/announcer";

describe("news for ears", () => {
  it("are who came and who left", () => {
    const event = { at: 0, user: 3, name: "ann", detail: "bye" };
    expect(spoken({ ...event, kind: "joined" })).toBe("ann has come.");
    expect(spoken({ ...event, kind: "left", name: "" })).toBe("User 3 has left.");
    expect(spoken({ ...event, kind: "latency" })).toBe("");
    expect(spoken({ ...event, kind: "restraint", detail: "is muted." })).toBe("ann is muted.");
    expect(spoken({ ...event, kind: "restraint", user: 0, name: "", detail: "The object is frozen." })).toBe("The object is frozen.");
  });
});
