import { describe, expect, it } from "vitest";
import { Invitation, type Place } from "../../src/page/invitation";

const SECRET = "eyJhbGciOiJIUzI1NiJ9.eyJzdWIiOiJhIn0.c2lnbmF0dXJl";

function tab(hash: string, kept: Record<string, string> = {}, pathname = "/r/two", search = "?x=1"): Place & { shown: string; kept: Record<string, string> } {
  const place = {
    shown: "",
    kept,
    location: { hash, pathname, search },
    history: {
      replaceState: (_data: unknown, _title: string, url?: string | URL | null): void => {
        place.shown = String(url);
        const { search, hash } = new URL(place.shown, "http://host");
        Object.assign(place.location, { search, hash });
      },
    },
    storage: {
      getItem: (key: string): string | null => kept[key] ?? null,
      setItem: (key: string, value: string): void => { kept[key] = value; },
      removeItem: (key: string): void => { kept[key] = ""; Reflect.deleteProperty(kept, key); },
    },
  };
  return place;
}

describe("an invitation in the link", () => {
  it("is read and taken out of the address bar", () => {
    const place = tab(`#token=${SECRET}`);
    expect(new Invitation(place).token).toBe(SECRET);
    expect(place.shown).toBe("/r/two?x=1");
  });

  it("leaves what else is behind the #", () => {
    const place = tab(`#view=top&token=${SECRET}`);
    expect(new Invitation(place).token).toBe(SECRET);
    expect(place.shown).toBe("/r/two?x=1#view=top");
  });

  it("changes nothing where there is none", () => {
    const place = tab("#view=top");
    expect(new Invitation(place).token).toBeUndefined();
    expect(place.shown).toBe("");
  });

  it.each(["", "a b", "\u00e4", "x".repeat(2049)])("is none of rubbish, which leaves the address bar too", (text) => {
    const place = tab(`#token=${encodeURIComponent(text)}`);
    expect(new Invitation(place).token).toBeUndefined();
    expect(place.shown).toBe("/r/two?x=1");
    expect(place.kept).toEqual({});
  });

  it.each([
    [`?token=${SECRET}`, "/r/two"],
    ["?token=", "/r/two"],
    ["?token", "/r/two"],
    [`?x=1&token=${SECRET}&name=a%26b&TOKEN=2`, "/r/two?x=1&name=a%26b"],
    ["?%74oken=1&%=1&token%20=3", "/r/two?%25=1"],
  ])("is none before the #, leaves the address bar from there, and is told to be misplaced: %s", (search, shown) => {
    const place = tab("", {}, "/r/two", search);
    const invitation = new Invitation(place);
    expect([invitation.misplaced, invitation.token]).toEqual([true, undefined]);
    expect(place.shown).toBe(shown);
    expect(place.kept).toEqual({});
  });

  it("is the one behind the # where there is one before it too", () => {
    const place = tab(`#view=top&token=${SECRET}`, {}, "/r/two", "?token=other&x=1");
    const invitation = new Invitation(place);
    expect([invitation.misplaced, invitation.token]).toEqual([true, SECRET]);
    expect(place.shown).toBe("/r/two?x=1#view=top");
  });

  it("is misplaced nowhere else", () => {
    expect(new Invitation(tab(`#token=${SECRET}`, {}, "/r/token", "?x=token&tokens=1")).misplaced).toBe(false);
  });

  it("outlives a reload of the tab, and its session takes its place", () => {
    const kept = {};
    const first = new Invitation(tab(`#token=${SECRET}`, kept));
    first.keep("session");
    expect(first.token).toBe("session");
    const again = new Invitation(tab("", kept));
    expect(again.token).toBe("session");
    expect(again.forget()).toBe(true);
    expect(again.token).toBe(SECRET);
    expect(again.forget()).toBe(false);
  });

  it("begins another session where it is another one", () => {
    const kept = {};
    new Invitation(tab("#token=one", kept)).keep("session of one");
    expect(new Invitation(tab("#token=one", kept)).token).toBe("session of one");
    expect(new Invitation(tab("#token=two", kept)).token).toBe("two");
  });

  it("is that of its room, where a tab has been in several", () => {
    const kept = {};
    new Invitation(tab("#token=one", kept, "/r/one/")).keep("session of one");
    new Invitation(tab("#token=two", kept, "/r/two/")).keep("session of two");
    const back = new Invitation(tab("", kept, "/r/one/"));
    expect(back.token).toBe("session of one");
    expect(back.forget()).toBe(true);
    expect(back.token).toBe("one");
    expect(new Invitation(tab("", kept, "/r/two/")).token).toBe("session of two");
  });

  it("is what the tab had last in a room that it brings none for", () => {
    const kept = {};
    new Invitation(tab("#token=all", kept, "/r/one/")).keep("session of all");
    expect(new Invitation(tab("", kept, "/r/two/")).token).toBe("session of all");
  });

  it("never goes with the session of another one", () => {
    const kept = {};
    new Invitation(tab("#token=two", kept, "/r/two/"));
    new Invitation(tab("#token=one", kept, "/r/one/")).keep("session of one");
    expect(new Invitation(tab("", kept, "/r/two/")).token).toBe("two");
  });

  it("works where nothing may be stored", () => {
    const place = tab(`#token=${SECRET}`);
    const fail = (): never => { throw new Error("forbidden"); };
    const strict = { ...place, storage: { getItem: fail, setItem: fail, removeItem: fail } };
    const invitation = new Invitation(strict);
    invitation.keep("session");
    expect(invitation.token).toBe("session");
    expect(new Invitation({ ...tab(`#token=${SECRET}`), storage: null }).token).toBe(SECRET);
  });
});
