import { describe, expect, it } from "vitest";
import { SERVER_STOPS, TOO_SLOW, UNAUTHENTICATED, WRONG_VERSION } from "../../src/protocol/close_codes";
import { notice, type NoticeFacts, period, sentence } from "../../src/ui/notice";

const WELL: NoticeFacts = {
  picture: "well", misplaced: false, clockStep: 0, phase: "watching", code: 0, reason: "", retryIn: 0, silent: 0, seen: true, slept: 0, letGo: false, touch: "", touchCode: 0, nameRefused: "", muted: false, frozen: false,
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

  it("say for how long there was no word, and take it back by themselves", () => {
    const silent = notice({ ...WELL, silent: 4.2 });
    expect(silent?.text).toContain("No word for 4 s");
    expect(silent?.key).toBe(notice({ ...WELL, silent: 9 })?.key);
    expect(notice({ ...WELL, silent: 0.9 })).toBeNull();
    expect(notice({ ...WELL, silent: 4.2, seen: false })).toBeNull();
  });

  it("say that the server stopped, if it said so", () => {
    expect(notice({ ...WELL, phase: "waiting", code: SERVER_STOPS })?.title).toBe("The server has stopped");
  });

  it("tell a page that was too slow so in words for people, and not by the server's counts", () => {
    for (const phase of ["waiting", "connecting"] as const) {
      const slow = notice({ ...WELL, phase, code: TOO_SLOW, reason: "silence is '10 s'; expected acks: 2 scenes wait for one" });
      expect(slow?.text).toContain("did not keep up");
      expect(slow?.text).not.toContain("acks");
    }
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
    expect(notice({ ...WELL, picture: "no webgl", phase: "waiting" })?.key).toBe("webgl");
  });

  it("ask for the picture again where it did not load", () => {
    expect(notice({ ...WELL, picture: "not loaded" })).toMatchObject({ key: "picture", action: "reload" });
  });

  it("welcome back from a pause, and say that the hand was let go", () => {
    expect(notice({ ...WELL, slept: 3700, letGo: true })?.text).toBe("The page was paused for 62 min. Your hand was let go meanwhile.");
  });

  it("say why a name was not changed, while the hand goes on", () => {
    expect(notice({ ...WELL, nameRefused: "name is 'bob'; expected one that is free" })).toMatchObject({
      title: "You keep your name", text: "Name is 'bob'; expected one that is free.", action: "dismiss",
    });
  });

  it("tell a hand why the object does not answer, and who was put out that it was", () => {
    expect(notice({ ...WELL, muted: true, frozen: true })?.title).toBe("You are muted");
    expect(notice({ ...WELL, frozen: true })?.title).toBe("The object is frozen");
    const reason = "you were put out of this room: you may come back in 300 s";
    expect(notice({ ...WELL, phase: "refused", code: 4403, reason })).toMatchObject({ title: "You are out of this room", text: "You were put out of this room: you may come back in 300 s." });
    expect(notice({ ...WELL, phase: "refused", code: 4403, reason: "no" })?.title).toBe("You may not come in");
  });

  it("say where a token belongs, also to whom it would have let in, and less urgently to others", () => {
    expect(notice({ ...WELL, misplaced: true })).toMatchObject({ key: "misplaced", action: "dismiss" });
    expect(notice({ ...WELL, misplaced: true })?.text).toContain("behind #");
    expect(notice({ ...WELL, misplaced: true, phase: "waiting" })?.key).toBe("lost");
    expect(notice({ ...WELL, misplaced: true, frozen: true })?.key).toBe("frozen");
    const refused = notice({ ...WELL, misplaced: true, phase: "refused", code: UNAUTHENTICATED, reason: "this server needs a token" });
    expect(refused?.title).toBe("You need an invitation");
    expect(refused?.text).toMatch(/^This server needs a token\. Tokens belong behind #/);
  });

  it("say that the browser's clock is coarse, where it is, once nothing else matters", () => {
    expect(notice({ ...WELL, clockStep: 0.1 })?.text).toContain("steps of 100 ms");
    expect(notice({ ...WELL, clockStep: 1 / 60 })).toBeNull();
    expect(notice({ ...WELL, clockStep: 0.1, muted: true })?.key).toBe("muted");
  });

  it("are sentences", () => {
    expect(sentence(" gone ")).toBe("Gone.");
    expect(sentence("Really?")).toBe("Really?");
    expect(sentence("")).toBe("");
    expect([period(12), period(600), period(9000)]).toEqual(["12 s", "10 min", "3 h"]);
  });
});
