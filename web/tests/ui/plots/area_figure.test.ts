import { describe, expect, it } from "vitest";
import type { UserState } from "../../../src/model/scene";
import { areaWords } from "../../../src/ui/plots/area_figure";
import { user } from "../../users";

describe("the words under the area", () => {
  it("say who is outside, and that a lag of the room keeps them from swinging", () => {
    const pressed: UserState = { ...user(1), law: "proportional", c_ii: 1 / 250, k_o_coupled: 140, k_h: 0.95 * 250, integral_gain: 0 };
    expect(areaWords([pressed], 1 / 60, 0, "coupled")).toContain("bound to swing: user 1");
    // Where the object takes its time that figure is not the whole of it.
    expect(areaWords([pressed], 1 / 60, 0.1, "coupled")).toContain("kept from swinging by the room\u2019s lag: user 1");
  });
});
