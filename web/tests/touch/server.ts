/** A server of one plane for tests, in virtual time: a sample in, a patch out at the next tick. */

import { decodeContactSample, type ContactSample } from "../../src/protocol/contact_sample";
import { newFrame } from "../../src/protocol/frame";
import type { LawName, Vec3 } from "../../src/types";
import { dot } from "../../src/vec";

export const PERIOD = 1 / 60;
export const C_II = 0.004; // m/N
export const NORMAL: Vec3 = [1, 0, 0];
export const SURFACE = 0.1; // m along the normal, at rest

export const WELCOME = {
  type: "welcome",
  protocol: 2,
  user: 3,
  name: "page",
  simulation_period: PERIOD,
  to_wall: 0,
  body: { name: "plane", center: [0, 0, 0], radius: 0.1, contact_radius: 0.02 },
  users: ["other"],
};

const LAWS: readonly LawName[] = ["proportional", "pi", "predictive"];

/** The bytes of a plane's patch; what a test needs of the encoder that the page has not. */
function planePatch(
  tick: number,
  sample: ContactSample | null,
  t: number,
  law: LawName,
  others: number,
  wait: number,
): Uint8Array {
  const view = newFrame("patch", 88, 1 | ((LAWS.indexOf(law) + 1) << 4));
  view.setUint32(4, tick, true);
  view.setUint32(8, sample?.seq ?? 0, true);
  view.setFloat64(12, t, true);
  view.setFloat64(20, sample?.t_client ?? 0, true);
  const own = sample === null ? 0 : Math.max(0, dot(sample.force, NORMAL));
  const x = SURFACE + others;
  const gain = law === "predictive" ? 1 / C_II : 0.5 / C_II;
  const values = [wait, x, 0, 0, ...NORMAL, 0, 1 / C_II, 1 / C_II, C_II, gain, 0, own, others];
  values.forEach((value, i) => {
    view.setFloat32(28 + 4 * i, value, true);
  });
  return new Uint8Array(view.buffer);
}

/** Keeps the newest sample, and makes a patch of it. */
export class PlaneServer {
  tick = 0;
  law: LawName = "predictive";
  /** How far others push the surface out [m]. */
  others = 0;
  readonly samples: ContactSample[] = [];

  private arrived = 0;
  /** How long the newest sample waited for its tick [s]. */
  wait = 0;

  take(bytes: Uint8Array, t: number): void {
    this.arrived = t;
    this.samples.push(decodeContactSample(bytes));
  }

  patch(t: number): Uint8Array {
    this.tick += 1;
    this.wait = t - this.arrived;
    return planePatch(this.tick, this.samples.at(-1) ?? null, t, this.law, this.others, this.wait);
  }
}
