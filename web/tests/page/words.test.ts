/** What the page says: notices, names, keys, numbers, feedback. */

import { describe, expect, it } from "vitest";
import { spoken } from "../../src/page/announcer";
import { freshName, usableName } from "../../src/page/names";
import { Watchfulness } from "../../src/page/sleep_detector";
import { deedOf, SHORTCUTS } from "../../src/ui/keyboard";
import { legendWords } from "../../src/ui/legend";
import { type Circumstances, notice, period, sentence, SERVER_STOPS, WRONG_VERSION } from "../../src/ui/notice";
import { rumble, vibration } from "../../src/ui/rumble";
import { bytesPerSecond, fixed, lagReasons, lagWords, softWords, stiffness } from "../../src/ui/words";

const WELL: Circumstances = {
  webgl: true, phase: "watching", code: 0, reason: "", retryIn: 0, seen: true, slept: 0, letGo: false, touch: "", touchCode: 0,
};

describe("notices", () => {
  it("are none where all is well", () => {
    expect(notice(WELL)).toBeNull();
  });

  it("tell the first connection from a lost one", () => {
    expect(notice({ ...WELL, phase: "connecting", seen: false })?.key).toBe("connecting");
    const lost = notice({ ...WELL, phase: "waiting", reason: "connection refused", retryIn: 2.2 });
    expect(lost?.title).toBe("The server is gone");
    expect(lost?.text).toBe("Connection refused. Trying again in 3 s.");
  });

  it("stay the same notice while it tries again: nobody wants to hear it twice", () => {
    const waiting = notice({ ...WELL, phase: "waiting", retryIn: 2 });
    const trying = notice({ ...WELL, phase: "connecting" });
    expect(waiting?.key).toBe(trying?.key);
  });

  it("say that the server stopped, if it said so", () => {
    expect(notice({ ...WELL, phase: "waiting", code: SERVER_STOPS })?.title).toBe("The server has stopped");
  });

  it("offer to reload after an upgrade, whatever the phase", () => {
    for (const phase of ["refused", "waiting", "connecting"] as const) {
      expect(notice({ ...WELL, phase, code: WRONG_VERSION })?.action).toBe("reload");
    }
    expect(notice({ ...WELL, code: WRONG_VERSION })).toBeNull();
  });

  it("pass on why a page or a hand was refused", () => {
    expect(notice({ ...WELL, phase: "refused", reason: "too many watchers: 100, at most 100" })?.text).toBe("Too many watchers: 100, at most 100.");
    expect(notice({ ...WELL, touch: "the name 'ann' is in use", touchCode: 4409 })?.text).toContain("Choose another name");
    expect(notice({ ...WELL, touch: "no place left" })?.action).toBe("dismiss");
  });

  it("explain a missing WebGL before anything else", () => {
    expect(notice({ ...WELL, webgl: false, phase: "waiting" })?.key).toBe("webgl");
  });

  it("welcome back from a pause, and say that the hand was let go", () => {
    expect(notice({ ...WELL, slept: 3700, letGo: true })?.text).toBe("The page was paused for 62 min and has caught up. Your hand was let go meanwhile.");
  });

  it("are sentences", () => {
    expect(sentence(" gone ")).toBe("Gone.");
    expect(sentence("Really?")).toBe("Really?");
    expect(sentence("")).toBe("");
    expect([period(12), period(600), period(9000)]).toEqual(["12 s", "10 min", "3 h"]);
  });
});

describe("pauses", () => {
  it("are noticed by the gap they leave, once the page has begun", () => {
    const w = new Watchfulness();
    let now = 0;
    w.frame(now);
    expect(w.frame((now += 9))).toBe(0);
    for (let i = 0; i < 20; i++) expect(w.frame((now += 0.016))).toBe(0);
    expect(w.frame((now += 60))).toBeCloseTo(60, 6);
    expect(w.told(now + 1)).toBeCloseTo(60, 6);
    expect(w.told(now + 60)).toBe(0);
  });

  it("of a slow machine are none, of the same length in the background they are", () => {
    const w = new Watchfulness();
    let now = 0;
    for (let i = 0; i < 20; i++) w.frame((now += 0.016));
    expect(w.frame((now += 6))).toBe(0);
    w.hide();
    expect(w.frame((now += 6))).toBeCloseTo(6, 6);
    expect(w.frame((now += 6))).toBe(0);
  });
});

describe("names", () => {
  it("are made printable, tidy and short", () => {
    expect(usableName("  ann \n b ", "x")).toBe("ann b");
    expect(usableName("\u202Eevil\u0007", "x")).toBe("evil");
    expect(usableName("\u0000 \u200B", "x")).toBe("x");
    expect(Array.from(usableName("\u{1F40C}".repeat(50), "x"))).toHaveLength(32);
  });

  it("stay text: markup is left as it was typed", () => {
    expect(usableName("<b>ann</b>", "x")).toBe("<b>ann</b>");
  });

  it("are invented where there is none", () => {
    expect(freshName(() => 0)).toBe("calm otter");
    expect(freshName(() => 0.999)).toBe("steady seal");
  });
});

describe("keys", () => {
  const key = (k: string, target: { tagName: string; type?: string } | null = null): string | null =>
    deedOf({ key: k, ctrlKey: false, metaKey: false, altKey: false }, target);

  it("do what the list says", () => {
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
    expect(deedOf({ key: "r", ctrlKey: true, metaKey: false, altKey: false }, null)).toBeNull();
  });
});

describe("numbers", () => {
  it("have a true minus and no minus on nothing", () => {
    expect([fixed(-1.26, 1), fixed(-0.001, 1), fixed(Number.NaN, 1)]).toEqual(["\u22121.3", "0.0", "\u2013"]);
  });

  it("of stiffness and of streams have the digits that count", () => {
    expect([stiffness(251.3), stiffness(0.4), stiffness(0), stiffness(2e5)]).toEqual(
      ["251\u202fN/m", "0.4\u202fN/m", "\u2013", "200\u202fN/mm"],
    );
    expect([bytesPerSecond(900), bytesPerSecond(5400), bytesPerSecond(120_000)]).toEqual(
      ["900\u202fB/s", "5.4\u202fkB/s", "120\u202fkB/s"],
    );
  });

  it("of the legend are millimetres, or what was found", () => {
    expect(legendWords({ colouring: "displacement", low: -0.02, high: 0.02 })).toEqual(["20 mm in", "at rest", "20 mm out"]);
    expect(legendWords({ colouring: "stiffness", low: null, high: null })[1]).toBe("touch it to find out");
    expect(legendWords({ colouring: "stiffness", low: 120, high: 251 })[2]).toBe("251 N/m");
  });
});

describe("feedback", () => {
  it("is silent without a force", () => {
    expect(rumble(0, 0)).toEqual({ strong: 0, weak: 0 });
    expect(vibration(0)).toEqual([]);
  });

  it("grows with the force up to what motors can", () => {
    expect(rumble(3, 0).strong).toBeCloseTo(0.5, 9);
    expect(rumble(60, 300)).toEqual({ strong: 1, weak: 1 });
    const [on, off] = vibration(3);
    expect(on).toBe(off);
  });
});

describe("news for ears", () => {
  it("are who came and who left", () => {
    const event = { at: 0, user: 3, name: "ann", detail: "bye" };
    expect(spoken({ ...event, kind: "joined" })).toBe("ann touches the object.");
    expect(spoken({ ...event, kind: "left", name: "" })).toBe("User 3 has left.");
    expect(spoken({ ...event, kind: "latency" })).toBe("");
  });
});

describe("the room's time", () => {
  const held = { lag: 0.0834, coupling: 1.3125, margin: 1.43 };

  it("is told to those who could feel another", () => {
    expect(lagWords(held, 2)).toBe("The object answers the others in 0.08 s");
    expect(lagWords({ ...held, lag: 0.004 }, 2)).toBe("The object answers the others at once");
    expect(lagWords(held, 1)).toBe("");
  });

  it("has a reason for hands at rest, for hands that move, and none where none is needed", () => {
    expect(lagReasons(held)).toContain("m is 1.31: from 1 on");
    expect(lagReasons(held)).toContain("1.4 times");
    expect(lagReasons({ lag: 0.05, coupling: 0.7, margin: 1.43 })).toContain("no lag (margin 1.4); hands that move");
    expect(lagReasons({ lag: 0, coupling: 0.65, margin: 1.54 })).toContain("no lag is needed (margin 1.5)");
    expect(lagReasons({ lag: 0, coupling: 0, margin: Infinity })).not.toContain("margin");
  });
});

describe("a device", () => {
  it("that is softer than the object is told of, with both", () => {
    expect(softWords({ law: "predictive", k_h: 2000, c_ii: 1 / 5000 })).toBe("device renders 2,000 of 5,000 N/m");
  });

  it("as stiff as the object, with a law of the paper, or nowhere is not", () => {
    expect(softWords({ law: "predictive", k_h: 250, c_ii: 1 / 250 })).toBe("");
    expect(softWords({ law: "predictive", k_h: 248, c_ii: 1 / 250 })).toBe("");
    expect(softWords({ law: "proportional", k_h: 100, c_ii: 1 / 250 })).toBe("");
    expect(softWords({ law: "predictive", k_h: 0, c_ii: 0 })).toBe("");
  });
});
