/** A server of one plane for tests, in virtual time: a sample in, a patch out at the next tick. */

import { type LawName, LAWS } from "../../src/model/laws";
import { dot, scale, type Vec3 } from "../../src/model/vec";
import { type ContactSample, decodeContactSample } from "../../src/protocol/contact_sample";
import { newFrame } from "../../src/protocol/frame";
import { PATCH_AT, PATCH_SIZE } from "../../src/protocol/layout";

export const PERIOD = 1 / 60;
export const C_II = 0.004; // m/N
export const NORMAL: Vec3 = [1, 0, 0];
export const LAG = 0.0625; // s, of its room
export const SURFACE = 0.1; // m along the normal, at rest

export const WELCOME = {
  type: "welcome",
  protocol: 6,
  user: 3,
  name: "page",
  simulation_period: PERIOD,
  to_wall: 0,
  body: { name: "plane", center: [0, 0, 0], radius: 0.1, contact_radius: 0.02 },
  users: [{ user: 2, name: "other" }],
};

/** The bytes of a plane's patch; the part of an encoder that tests need. */
function planePatch(
  tick: number,
  sample: ContactSample | null,
  t: number,
  law: LawName,
  others: Vec3,
  wait: number,
  along: readonly number[],
): Uint8Array {
  const view = newFrame("patch", PATCH_SIZE + 4 * along.length, 1 | ((LAWS.indexOf(law) + 1) << 4) | (along.length > 0 ? 0x100 : 0));
  view.setUint32(PATCH_AT.tick, tick, true);
  view.setUint32(PATCH_AT.seq, sample?.seq ?? 0, true);
  view.setFloat64(PATCH_AT.t_server, t, true);
  view.setFloat64(PATCH_AT.t_client, sample?.t_client ?? 0, true);
  // Without friction the body carries the part along the normal, with it all of the force.
  const pressed = sample === null ? 0 : Math.max(0, dot(sample.force, NORMAL));
  const own: Vec3 = along.length > 0 && sample !== null ? sample.force : scale(NORMAL, pressed);
  const x_free: Vec3 = [SURFACE + others[0], others[1], others[2]];
  const gain = law === "predictive" ? 1 / C_II : 0.5 / C_II;
  const values = [wait, ...x_free, ...NORMAL, 0, C_II, gain, 0, ...own, ...others, LAG];
  values.forEach((value, i) => {
    view.setFloat32(PATCH_AT.sample_wait + 4 * i, value, true);
  });
  view.setUint16(PATCH_AT.coupling, 0x3d00, true); // m = 1.25
  view.setUint16(PATCH_AT.margin, 0x3e00, true); // margin 1.5
  along.forEach((value, i) => {
    view.setFloat32(PATCH_SIZE + 4 * i, value, true);
  });
  return new Uint8Array(view.buffer);
}

/** Keeps the newest sample, and makes a patch of it. */
export class PlaneServer {
  tick = 0;
  law: LawName = "predictive";
  /** How far others push the surface out, and drag it [m]. */
  others: Vec3 = [0, 0, 0];
  /** Whether the hand asked for friction: the contact is then as soft along the surface as into it. */
  friction = false;
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
    const along = this.friction ? [C_II, C_II, C_II, 0, 0, 0] : [];
    return planePatch(this.tick, this.samples.at(-1) ?? null, t, this.law, this.others, this.wait, along);
  }
}
