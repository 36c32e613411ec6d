// @vitest-environment node
import { describe, expect, test, vi } from "vitest";
import { CompanyCorner } from "../../src/company/corner";
import type { Surroundings } from "../../src/company/surroundings";

const asked: string[] = [];
vi.mock("../../src/ui/dom", () => ({ el: () => ({ append: () => undefined }) }));
vi.mock("../../src/company/place", () => ({
  CompanyPlace: class {
    following = null;
    told = { root: null };
    pill = { root: null };
    bar = { root: null };
    follow(user: number | null): void { asked.push(`follow ${user}`); }
    followNext(): void { asked.push("next"); }
    update(): void { return undefined; }
  },
}));
vi.stubGlobal("location", { search: "" });

describe("what is asked while the place is on its way", () => {
  test("is done once it is here, the newest wish alone", async () => {
    const corner = new CompanyCorner({ store: { company: { state: {} } } } as unknown as Surroundings);
    corner.followNext();
    corner.toggle(7);
    expect(asked).toEqual([]);
    corner.update(0);
    await vi.waitFor(() => { expect(asked).toEqual(["follow 7"]); });
    corner.followNext();
    expect(asked).toEqual(["follow 7", "next"]);
  });
});
