/** Client to server, once per simulation period: position of the tip and force on the hand. */

import type { Vec3 } from "../model/vec";
import {
  checkFinite,
  checkInteger,
  checkSize,
  checkVector,
  MAX_FORCE,
  MAX_POSITION,
  newFrame,
  openFrame,
  U32,
} from "./frame";

export const CONTACT_SAMPLE_SIZE = 44;
const ANCHORED = 1; // flag: an anchor follows
const ANCHOR_SIZE = 12;

export interface ContactSample {
  /** Number of this client's sample, from 1. */
  readonly seq: number;
  /** Tick of the newest patch that the client has used; 0 for none. */
  readonly tick: number;
  /** Time of the sample, on the client's clock [s]. */
  readonly t_client: number;
  /** Position of the tip, world frame [m]. */
  readonly probe: Vec3;
  /** Force on the hand, world frame [N]. */
  readonly force: Vec3;
  /** Point of the resting surface that the finger holds by friction [m]; null without friction or contact. */
  readonly anchor: Vec3 | null;
}

export function encodeContactSample(sample: ContactSample): Uint8Array<ArrayBuffer> {
  check(sample);
  const anchor = sample.anchor ?? [];
  const view = newFrame("contact_sample", CONTACT_SAMPLE_SIZE + 4 * anchor.length);
  if (sample.anchor !== null) view.setUint16(2, ANCHORED, true);
  view.setUint32(4, sample.seq, true);
  view.setUint32(8, sample.tick, true);
  view.setFloat64(12, sample.t_client, true);
  [...sample.probe, ...sample.force, ...anchor].forEach((value, i) => {
    view.setFloat32(20 + 4 * i, value, true);
  });
  return new Uint8Array(view.buffer);
}

/** Decode the sample in a frame; throws ProtocolError for any invalid bytes. */
export function decodeContactSample(bytes: Uint8Array): ContactSample {
  const { flags, reader } = openFrame(bytes, "contact_sample", CONTACT_SAMPLE_SIZE);
  checkInteger("flags of a contact sample", flags, 0, ANCHORED);
  checkSize("contact_sample", bytes, CONTACT_SAMPLE_SIZE + (flags ? ANCHOR_SIZE : 0));
  const sample = {
    seq: reader.u32(),
    tick: reader.u32(),
    t_client: reader.f64(),
    probe: reader.vec(),
    force: reader.vec(),
    anchor: flags ? reader.vec() : null,
  };
  check(sample);
  return sample;
}

function check(sample: ContactSample): void {
  checkInteger("seq of a contact sample", sample.seq, 1, U32);
  checkInteger("tick of a contact sample", sample.tick, 0, U32);
  checkFinite("t_client", sample.t_client);
  checkVector("probe", sample.probe, MAX_POSITION, "m");
  checkVector("force", sample.force, MAX_FORCE, "N");
  if (sample.anchor !== null) checkVector("anchor", sample.anchor, MAX_POSITION, "m");
}
