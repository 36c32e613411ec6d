import { expect, test } from "vitest";
import type { Company } from "../../src/model/company";
import type { ClientControl } from "../../src/protocol/messages";
import { CompanyTalk } from "../../src/watch/company";
import type { WatchEvent } from "../../src/watch/session";

const ALONE: Company = { watching: 1, open: [], following: null, followers: [], may_point: true };
const WATCHING = { type: "watching" } as WatchEvent;
const SELF = { name: "ann", user: 3, key: "0123456789abcdef", open: true };

function talk(): { readonly company: CompanyTalk; readonly said: ClientControl[] } {
  const said: ClientControl[] = [];
  return { company: new CompanyTalk((message) => { said.push(message); }), said };
}

test("nothing is said to a server that tells of no company", () => {
  const { company, said } = talk();
  company.present(SELF);
  company.follow(1);
  company.aim({ azimuth: 0, elevation: 0, distance: 4 });
  company.point([0, 0, 0]);
  expect(said).toEqual([]);
});

test("who sits here is said at first, at each change, and once more to a new connection", () => {
  const { company, said } = talk();
  company.present(SELF);
  company.take({ type: "company", ...ALONE }, 1);
  company.present({ ...SELF });
  company.present({ ...SELF, open: false });
  expect(said).toEqual([{ type: "present", ...SELF }, { type: "present", ...SELF, open: false }]);
  company.take({ type: "company", ...ALONE, watching: 2 }, 2);
  expect(said.length).toBe(2);
});

test("a view that was followed is none once the server says so", () => {
  const { company } = talk();
  company.take({ type: "company", ...ALONE, following: 2 }, 1);
  company.take({ type: "aimed", user: 2, azimuth: 1, elevation: 0.5, distance: 4 }, 1);
  expect(company.aimed).toMatchObject({ user: 2, azimuth: 1 });
  company.take({ type: "company", ...ALONE }, 2);
  expect(company.aimed).toBeNull();
});

test("who was followed is followed again after a lost connection, unless the view was moved meanwhile", () => {
  for (const moved of [false, true]) {
    const { company, said } = talk();
    company.take({ type: "company", ...ALONE, following: 2 }, 1);
    company.take(WATCHING, 2);
    if (moved) company.follow(null);
    company.take({ type: "company", ...ALONE }, 3);
    expect(said).toEqual(moved ? [] : [{ type: "follow", user: 2 }]);
  }
});

test("the newest marks are kept, and no more than sixteen", () => {
  const { company } = talk();
  for (let k = 0; k < 40; k += 1) company.take({ type: "pointed", user: k, name: `n${k}`, point: [0, 0, 0] }, k);
  expect(company.marks.map(({ user }) => user)).toEqual(Array.from({ length: 16 }, (_, k) => 24 + k));
});
