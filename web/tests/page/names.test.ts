import { describe, expect, it } from "vitest";
import { freshName, usableName } from "../../src/page/names";

describe("names", () => {
  it("are made printable, tidy and short", () => {
    expect(usableName("  ann \n b ", "x")).toBe("ann b");
    expect(usableName("\u202Eevil\u0007", "x")).toBe("evil");
    expect(usableName("\u0000 \u200B", "x")).toBe("x");
    expect(Array.from(usableName("\u{1F40C}".repeat(50), "x"))).toHaveLength(32);
  });

  it("are what a server takes: compatibility forms are plain letters, and nothing is unseen", () => {
    expect(usableName("\u00A0\uFF41\uFF4E\uFF4E ", "x")).toBe("ann");
    expect(usableName("a\uFE0Fn\u3164n\u200D\u2800", "x")).toBe("ann");
    expect(usableName("\u3164", "x")).toBe("x");
    expect(Array.from(usableName("\uFDFA".repeat(9), "x")).length).toBeLessThanOrEqual(32);
  });

  it("stay text: markup is left as it was typed", () => {
    expect(usableName("<b>ann</b>", "x")).toBe("<b>ann</b>");
  });

  it("are invented where there is none", () => {
    expect(freshName(() => 0)).toBe("calm otter");
    expect(freshName(() => 0.999)).toBe("steady seal");
  });
});
