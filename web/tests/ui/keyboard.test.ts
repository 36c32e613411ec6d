import { describe, expect, it } from "vitest";
import { actionOf, SHORTCUTS } from "../../src/ui/keyboard";

describe("keys", () => {
  const key = (k: string, target: { tagName: string; type?: string } | null = null): string | null =>
    actionOf({ key: k, ctrlKey: false, metaKey: false, altKey: false }, target);

  it("do as the list says", () => {
    expect([key("ArrowLeft"), key("+"), key("-"), key("R"), key("f"), key("T"), key("?"), key(" ")]).toEqual(
      ["left", "closer", "farther", "reset", "full", "touch", "help", "press"],
    );
  });

  it("are each in the list once", () => {
    const all = SHORTCUTS.flatMap((s) => s.keys);
    expect(new Set(all).size).toBe(all.length);
  });

  it("leave fields, sliders, buttons and the browser alone", () => {
    expect(key("t", { tagName: "INPUT", type: "text" })).toBeNull();
    expect(key("Escape", { tagName: "INPUT", type: "text" })).toBe("escape");
    expect(key("ArrowLeft", { tagName: "INPUT", type: "range" })).toBeNull();
    expect(key("t", { tagName: "INPUT", type: "range" })).toBe("touch");
    expect(key(" ", { tagName: "BUTTON" })).toBeNull();
    expect(actionOf({ key: "r", ctrlKey: true, metaKey: false, altKey: false }, null)).toBeNull();
  });
});
