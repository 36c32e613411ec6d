/** Client to server, once per simulation period: position of the tip and force on the hand. */

import type { Vec3 } from "../model/vec";
import {
  checkFinite,
  checkInteger,
  checkSize,
  checkVector,
  newFrame,
  openFrame,
  U32,
} from "./frame";
import {
  ANCHOR_SIZE,
  CONTACT_SAMPLE_SIZE,
  type ContactSampleFields,
  MAX_FORCE,
  MAX_POSITION,
  readAnchor,
  readContactSampleFields,
  writeAnchor,
  writeContactSampleFields,
} from "./layout";

const ANCHORED = 1; // flag: an anchor follows

export interface ContactSample extends ContactSampleFields {
  /** Point of the resting surface that the finger holds by friction [m]; null without friction or contact. */
  readonly anchor: Vec3 | null;
}

export function encodeContactSample(sample: ContactSample): Uint8Array<ArrayBuffer> {
  check(sample);
  const { anchor } = sample;
  const view = newFrame("contact_sample", CONTACT_SAMPLE_SIZE + (anchor ? ANCHOR_SIZE : 0), anchor ? ANCHORED : 0);
  writeContactSampleFields(view, sample);
  if (anchor) writeAnchor(view, CONTACT_SAMPLE_SIZE, anchor);
  return new Uint8Array(view.buffer);
}

/** Decode the sample in a frame; throws ProtocolError for any invalid bytes. */
export function decodeContactSample(bytes: Uint8Array): ContactSample {
  const { flags, view } = openFrame(bytes, "contact_sample", CONTACT_SAMPLE_SIZE);
  checkInteger("flags of a contact sample", flags, 0, ANCHORED);
  checkSize("contact_sample", bytes, CONTACT_SAMPLE_SIZE + (flags ? ANCHOR_SIZE : 0));
  const sample = { ...readContactSampleFields(view), anchor: flags ? readAnchor(view, CONTACT_SAMPLE_SIZE) : null };
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
