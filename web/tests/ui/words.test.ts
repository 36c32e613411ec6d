import { describe, expect, it } from "vitest";
import { bytesPerSecond, connectionWords, fixed, lagReasons, lagWords, named, softWords, stiffness } from "../../src/ui/words";

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
});

describe("a name", () => {
  it("that is written to the left does not take the number after it along", () => {
    expect([named("שלום"), named("مرحبا 7")]).toEqual(["\u2068שלום\u2069", "\u2068مرحبا 7\u2069"]);
    expect([named("ann"), named("李小龍"), named("Ω 9")]).toEqual(["ann", "李小龍", "Ω 9"]);
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
    expect(lagReasons(held)).toContain("m is 1.31 (margin 1.4): this lag keeps");
    expect(lagReasons({ lag: 0.05, coupling: 0.7, margin: 1.43 })).toContain("no lag (margin 1.4); moving hands");
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

describe("a connection", () => {
  const user = { fresh: true, loop_delay: 0.167, latency: { delay: 0, jitter: 0, network: "" }, presence: 1 };
  const own = { network: 0.0004, page_wait: 0.12, clock_step: 0, tick_late: 0.01, loop_stall: 0.02, wavers: 0.004 };

  it("of the own hand is as far as its network, and what the page adds is told apart", () => {
    expect(connectionWords(user, own)).toBe("Close by: under 1\u202fms there and back; this page is up to 167\u202fms late");
    expect(connectionWords({ ...user, loop_delay: 0.3 }, { ...own, network: 0.2, page_wait: 0.03 })).toBe("Some way off: 200\u202fms there and back; this page is up to 60\u202fms late");
  });

  it("whose network is slow, or a server's tick, is not the page's fault", () => {
    expect(connectionWords({ ...user, loop_delay: 0.25 }, { ...own, network: 0.2, page_wait: 0.004 })).toBe("Some way off: 200\u202fms there and back");
    expect(connectionWords({ ...user, loop_delay: 0.033 }, own)).toBe("Close by: under 1\u202fms there and back");
    expect(connectionWords({ ...user, loop_delay: 0.02 }, { ...own, network: 0.05 })).toBe("Close by: 50\u202fms there and back");
  });

  it("that holds messages up now and then is as far as that, whatever the shortest trip is", () => {
    const spikes = { ...user, loop_delay: 0.42 };
    expect(connectionWords(spikes, { ...own, network: 0.02, page_wait: 0.004 })).toBe("Far away: 20\u202fms there and back, now and then up to 412\u202fms");
    expect(connectionWords(spikes, { ...own, network: 0.02, page_wait: 0.1 })).toBe(
      "Some way off: 20\u202fms there and back, now and then up to 220\u202fms; this page is up to 200\u202fms late",
    );
  });

  it("says no more than a coarse clock can know, and a delay that was added at once", () => {
    expect(connectionWords(user, { ...own, page_wait: 0.07, clock_step: 0.1 })).toBe("Close by: under 100\u202fms there and back");
    expect(connectionWords(user, { ...own, page_wait: 0, clock_step: 0.1 })).toBe("Close by: under 100\u202fms there and back");
    expect(connectionWords({ ...user, loop_delay: 0.5, latency: { delay: 0.24, jitter: 0, network: "" } }, { ...own, page_wait: 0 })).toBe(
      "Far away: 480\u202fms there and back, 240\u202fms of it each way added here",
    );
  });

  it("names whom a hand waited for: the server's ticks, or its own machine", () => {
    const near = { ...user, loop_delay: 0.033 };
    expect(connectionWords(near, { ...own, page_wait: 0, tick_late: 0.12 })).toBe(
      "Close by: under 1\u202fms there and back; the server is up to 120\u202fms late",
    );
    expect(connectionWords(near, { ...own, page_wait: 0, wavers: 0.034 })).toContain("; the link wavers: 34\u202fms");
    const stopped = { ...own, page_wait: 0, loop_stall: 0.31 };
    expect(connectionWords(near, stopped)).toBe("Close by: under 1\u202fms there and back; this browser is up to 310\u202fms late");
    expect(connectionWords(near, { ...stopped, clock_step: 0.3 })).toBe("Close by: under 300\u202fms there and back");
  });

  it("of others, or before the network is measured, is what the server measures of all of it", () => {
    for (const link of [null, { ...own, network: null }]) expect(connectionWords(user, link)).toBe("Some way off: 167\u202fms there and back, its machine included");
    expect(connectionWords({ ...user, loop_delay: 0 }, own)).toBe("Just came");
    expect(connectionWords({ ...user, fresh: false }, own)).toBe("Connection lost");
  });
});
