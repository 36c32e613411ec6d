// @vitest-environment node
import { beforeAll, describe, expect, test, vi } from "vitest";
import type { Company } from "../../src/model/company";
import type { Vec3 } from "../../src/model/vec";
import type { SceneStore } from "../../src/model/scene";
import type { TouchState } from "../../src/model/hand";
import type { ClientControl } from "../../src/protocol/messages";
import { HOME, type Orbit } from "../../src/view/orbit";
import { CompanyTalk } from "../../src/watch/company";

// Of the company only what it decides is tested here; its elements are seen in a browser.
vi.mock("../../src/company/bar", () => ({ CompanyBar: class { update(): void { return undefined; } } }));
vi.mock("../../src/company/told", () => ({ Told: class { update(): void { return undefined; } } }));
vi.mock("../../src/company/pill", () => ({ Pill: class { line: unknown = null; set(line: unknown): void { this.line = line; } } }));
let CompanyPlace: typeof import("../../src/company/place").CompanyPlace;
beforeAll(async () => { ({ CompanyPlace } = await import("../../src/company/place")); });

const STATE: Company = { watching: 1, open: [2, 5], following: null, followers: [], may_point: true };

function place(search = "") {
  const said: ClientControl[] = [];
  const company = new CompanyTalk((message) => { said.push(message); });
  company.take({ type: "company", ...STATE }, 0);
  const stage = { target: HOME, goTo(orbit: Orbit): void { this.target = orbit; } };
  const roster = [{ user: 1, name: "me" }, { user: 2, name: "ann" }, { user: 5, name: "bob" }];
  const spoken: string[] = [];
  const made = new CompanyPlace({
    store: { company, roster } as unknown as SceneStore,
    present: null,
    colour: () => "#0a7f52",
    stage,
    own: { state: { phase: "joined", user: 1 } as TouchState, placeAt: (origin): Vec3 | null => (origin[0] > 0 ? origin : null) },
    visitor: { name: "me" },
    speak: (words) => { spoken.push(words); },
    settings: { key: "0123456789abcdef" },
  }, search);
  const hear = (change: Partial<Company>): void => { company.take({ type: "company", ...STATE, ...change }, 0); };
  const line = (): string => (made.pill as unknown as { line: { words: string } | null }).line?.words ?? "";
  return { made, company, said, stage, spoken, hear, line };
}

describe("following", () => {
  test("the view goes where the followed one looks, until it is moved", () => {
    const { made, company, said, stage, hear, line } = place();
    made.follow(2);
    hear({ following: 2 });
    company.take({ type: "aimed", user: 2, azimuth: 1, elevation: 1.59, distance: 40 }, 0);
    made.frame();
    expect(stage.target).toEqual({ azimuth: 1, elevation: 1.5, distance: 12 });
    made.update(1);
    expect(line()).toBe("You see what ann sees.");
    made.moved();
    company.take({ type: "aimed", user: 2, azimuth: 2, elevation: 0, distance: 4 }, 0);
    made.frame();
    expect(stage.target.azimuth).toBe(1);
    expect(made.following).toBeNull();
    expect(said.filter(({ type }) => type === "follow")).toEqual([{ type: "follow", user: 2 }, { type: "follow", user: null }]);
  });

  test("the key goes from one to the next and back to the own view", () => {
    const { made, said, hear } = place();
    for (const following of [2, 5, null]) {
      made.followNext();
      hear({ following });
      made.update(1);
    }
    expect(said.filter(({ type }) => type === "follow")).toEqual([2, 5, null].map((user) => ({ type: "follow", user })));
  });

  test("the address names whom to follow, once", () => {
    const { made, said } = place("?follow=bob");
    made.update(1);
    made.update(2);
    expect(said.filter(({ type }) => type === "follow")).toEqual([{ type: "follow", user: 5 }]);
  });

  test("a refusal is a sentence that goes away", () => {
    const { made, company, line } = place();
    company.take({ type: "declined", what: "follow", reason: "ann keeps its view to itself." }, 10);
    made.update(11);
    expect(line()).toBe("ann keeps its view to itself.");
    made.update(20);
    expect(line()).toBe("");
  });
});

describe("being followed", () => {
  test("the own view is told while somebody follows, where it has changed, within half a turn", () => {
    const { made, said, stage, hear, line } = place();
    made.update(0);
    hear({ followers: [{ user: 2, name: "ann" }] });
    stage.target = { azimuth: 1 + 4 * Math.PI, elevation: 0.25, distance: 4 };
    made.update(1);
    made.update(2);
    const aims = said.filter((message) => message.type === "aim");
    expect(aims.length).toBe(1);
    expect(aims[0]).toMatchObject({ elevation: 0.25, distance: 4 });
    expect(aims[0]?.azimuth).toBeCloseTo(1, 9);
    expect(line()).toBe("ann sees what you see.");
    hear({ followers: [{ user: 2, name: "ann" }, { user: null, name: "eve" }] });
    made.update(3);
    expect(said.filter(({ type }) => type === "aim").length).toBe(2);
  });

  test("the page says whose it is, with the hand\u2019s secret", () => {
    const { made, said } = place();
    made.update(0);
    expect(said[0]).toEqual({ type: "present", name: "me", user: 1, open: true, key: "0123456789abcdef" });
  });
});

test("one points at the object alone, and not again at once", () => {
  const { made, company, said, spoken } = place();
  expect(made.point([-1, 0, 0], [0, 0, 1], 5)).toBe(false);
  made.armed = true;
  expect(made.point([1, 0, 0], [0, 0, 1], 5)).toBe(true);
  expect(made.point([1, 0, 0], [0, 0, 1], 5.2)).toBe(true);
  expect(made.armed).toBe(false);
  expect(said.filter(({ type }) => type === "point")).toEqual([{ type: "point", point: [1, 0, 0] }]);
  company.take({ type: "pointed", user: 2, name: "ann", point: [1, 0, 0] }, 6);
  made.update(6);
  made.update(6.1);
  expect(spoken).toEqual(["ann points at the object."]);
});
