import { describe, expect, it } from "vitest";
import { actionOf, type KeyAction, keyOf, type Keystroke, SHORTCUTS } from "../../src/ui/keyboard";

/** @param held Modifiers, by the names of the standard. */
function stroke(key: string, code = "", ...held: readonly string[]): Keystroke {
  const getModifierState = (name: string): boolean => held.includes(name);
  return { key, code, ctrlKey: held.includes("Control"), metaKey: held.includes("Meta"), altKey: held.includes("Alt"), getModifierState };
}

const at = (key: string, code: string, ...held: readonly string[]): KeyAction | null => actionOf(stroke(key, code, ...held), null);

describe("keys", () => {
  const key = (k: string, target: { tagName: string; type?: string } | null = null): string | null => actionOf(stroke(k), target);

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
    expect(actionOf(stroke("е", "KeyT"), { tagName: "INPUT", type: "text" })).toBeNull();
    for (const held of ["Control", "Meta", "Alt"]) {
      expect([at("r", "KeyR", held), at("к", "KeyR", held), at("+", "Equal", held), at("[", "BracketLeft", held), at("ü", "BracketLeft", held)]).toEqual([null, null, null, null, null]);
    }
  });
});

describe("on a keyboard of another alphabet", () => {
  const CODES: Readonly<Record<string, KeyAction>> = {
    KeyT: "touch", KeyG: "tour", KeyR: "reset", KeyF: "full", KeyD: "theme", KeyB: "replay", KeyL: "delay", KeyP: "point", KeyV: "follow",
  };

  it.each([
    ["Russian", "епкавидзм"],
    ["Greek", "τγρφδβλπω"],
    ["Hebrew", "אערכגנךפה"],
    ["Thai", ["ะ", "เ", "พ", "ด", "ก", "\u0e34", "ส", "ย", "อ"]],
    ["Arabic", ["ف", "ل", "ق", "ب", "ي", "لا", "م", "ح", "ر"]],
    ["Korean", "ㅅㅎㄱㄹㅇㅠㅣㅔㅍ"],
  ])("%s, the letters are where a Latin one has them", (_name, letters) => {
    const codes = Object.keys(CODES);
    expect(Array.from(letters, (letter, i) => at(letter, codes[i] ?? ""))).toEqual(Object.values(CODES));
    expect(Array.from(letters, (letter, i) => at(letter.toUpperCase(), codes[i] ?? "", "Shift"))).toEqual(Object.values(CODES));
  });

  it("so are brackets, commas, and what zooms, unless they are printed elsewhere", () => {
    expect([at("х", "BracketLeft"), at("ъ", "BracketRight"), at("б", "Comma"), at("ю", "Period")]).toEqual(["shallower", "deeper", "shallower", "deeper"]);
    expect([at(".", "Slash"), at("ข", "Minus"), at("ช", "Equal"), at("\u061f", "Slash", "Shift")]).toEqual(["deeper", "farther", "closer", "help"]);
    // A Hebrew one has its brackets the other way round.
    expect([at("]", "BracketLeft"), at("[", "BracketRight")]).toEqual(["deeper", "shallower"]);
  });

  it("and where an input method keeps the letter for itself, or writes wide ones", () => {
    expect([at("Process", "KeyT"), at("Unidentified", "KeyT"), at("\uff54", "KeyT"), at("Process", "Enter")]).toEqual(["touch", "touch", "touch", null]);
    expect(keyOf(stroke("\u3000", "Space"))).toBe(" ");
    expect(keyOf(stroke("Process", "Space"))).toBe(" ");
  });
});

describe("on another Latin keyboard", () => {
  it("a letter is the one that is printed, wherever it is", () => {
    const dvorak = ["y", "i", "p", "u", "e", "x", "n", "l", "k"];
    expect(dvorak.map((k, i) => at(k, `Key${"TGRFDBPPV"[i] ?? ""}`))).toEqual([null, null, "point", null, null, null, null, "delay", null]);
    // Of Turkish F, Bépo, Colemak and German.
    const none = [["ı", "KeyR"], ["è", "KeyT"], [";", "KeyP"], ["ß", "Minus"], ["Dead", "Equal"], ["´", "Equal"], ["z", "BracketLeft"], ["/", "BracketLeft"]] as const;
    expect(none.map(([k, code]) => at(k, code))).toEqual(none.map(() => null));
    expect(at(".", "KeyV")).toBe("deeper");
  });

  it("brackets that need a third level are where they would be, or typed", () => {
    expect([at("ü", "BracketLeft"), at("å", "BracketLeft"), at("Dead", "BracketLeft"), at("¨", "BracketRight"), at("$", "BracketRight")]).toEqual(
      ["shallower", "shallower", "shallower", "deeper", "deeper"],
    );
    expect([at("+", "BracketRight"), at("{", "BracketLeft", "Shift")]).toEqual(["closer", null]); // + is printed there on a German one
    for (const level of [["Control", "Alt", "AltGraph"], ["AltGraph"]]) {
      expect([at("[", "Digit8", ...level), at("]", "Digit9", ...level)]).toEqual(["shallower", "deeper"]);
      expect([at("ŧ", "KeyT", ...level), at("€", "BracketLeft", ...level)]).toEqual([null, null]);
    }
    expect([at("t", "KeyT", "Control", "Alt", "AltGraph"), at("[", "Digit8", "Control", "Alt")]).toEqual([null, null]);
  });
});
