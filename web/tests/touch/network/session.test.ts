import { describe, expect, test } from "vitest";
import { Browser } from "../browser";
import { WELCOME } from "../server";

describe("a full room", () => {
  test("has a queue: its place is told, it answers a call, and comes in", () => {
    const browser = new Browser();
    browser.line.onopen?.();
    browser.line.say({ type: "place", place: 2, of: 3 });
    browser.run(0.1, false);
    expect(browser.state).toMatchObject({ phase: "connecting", place: [2, 3], user: 0 });
    expect(browser.line.texts.map(({ type }) => type)).toEqual(["hello"]);
    browser.line.say({ type: "called", within: 5 });
    expect(browser.line.texts.at(-1)).toEqual({ type: "come" });
    browser.run(0.1, false);
    expect(browser.state.phase).toBe("connecting");
    browser.line.say(WELCOME);
    browser.run(0.5);
    expect(browser.state).toMatchObject({ phase: "joined", place: null, user: WELCOME.user });
  });

  test("loses the place of a hand that leaves, or is cut, and calls nobody who has left", () => {
    const browser = new Browser();
    browser.line.onopen?.();
    browser.line.say({ type: "place", place: 1, of: 1 });
    browser.line.break();
    browser.run(0.1, false);
    expect(browser.state).toMatchObject({ phase: "connecting", place: null });
    browser.run(1, false);
    browser.line.onopen?.();
    browser.line.say({ type: "place", place: 1, of: 1 });
    browser.client.obey({ type: "close" });
    browser.line.say({ type: "called", within: 5 });
    browser.run(0.1, false);
    expect(browser.line.texts.map(({ type }) => type)).toEqual(["hello"]);
    expect(browser.line.closed).toBe(1000);
  });
});
