/** Client to server, once per simulation period: position of the tip and force on the hand. */

import type { Vec3 } from "../model/vec";
import {
  checkFinite,
  checkInteger,
  checkRange,
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
  DEFLECTION_SIZE,
  MAX_FORCE,
  MAX_POSITION,
  OWN_MODEL_SIZE,
  type OwnModelFields,
  readAnchor,
  readContactSampleFields,
  readDeflection,
  readOwnModelFields,
  writeAnchor,
  writeContactSampleFields,
  writeDeflection,
  writeOwnModelFields,
} from "./layout";

const ANCHORED = 1; // flag: an anchor follows
const SIMULATED = 6; // flags: the deflection and the hand itself follow; the page sends both or neither
const TOLD_SIZE = DEFLECTION_SIZE + OWN_MODEL_SIZE;

export interface ContactSample extends ContactSampleFields {
  /** Point of the resting surface that the finger holds by friction [m]; null without friction or contact. */
  readonly anchor: Vec3 | null;
  /** Displacement of the hand by the forces on it, out of the body [m]; null for a hand that is not told. */
  readonly deflection: number | null;
  /** The hand itself; null without a deflection. */
  readonly own_model: OwnModelFields | null;
}

export function encodeContactSample(sample: ContactSample): Uint8Array<ArrayBuffer> {
  check(sample);
  const { anchor, deflection, own_model } = sample;
  const [at, flags] = anchor ? [CONTACT_SAMPLE_SIZE + ANCHOR_SIZE, ANCHORED] : [CONTACT_SAMPLE_SIZE, 0];
  const told = deflection !== null && own_model !== null;
  const view = newFrame("contact_sample", told ? at + TOLD_SIZE : at, told ? flags + SIMULATED : flags);
  writeContactSampleFields(view, sample);
  if (anchor) writeAnchor(view, CONTACT_SAMPLE_SIZE, anchor);
  if (told) {
    writeDeflection(view, at, deflection);
    writeOwnModelFields(view, at + DEFLECTION_SIZE, own_model);
  }
  return new Uint8Array(view.buffer);
}

/** Decode the sample in a frame; throws ProtocolError for any invalid bytes, and for a deflection without the hand. */
export function decodeContactSample(bytes: Uint8Array): ContactSample {
  const { flags, view } = openFrame(bytes, "contact_sample", CONTACT_SAMPLE_SIZE);
  const simulated = flags >= SIMULATED;
  checkInteger("flags of a contact sample", simulated ? flags - SIMULATED : flags, 0, ANCHORED);
  const at = CONTACT_SAMPLE_SIZE + (flags & ANCHORED ? ANCHOR_SIZE : 0);
  checkSize("contact_sample", bytes, simulated ? at + TOLD_SIZE : at);
  const sample = {
    ...readContactSampleFields(view),
    anchor: flags & ANCHORED ? readAnchor(view, CONTACT_SAMPLE_SIZE) : null,
    deflection: simulated ? readDeflection(view, at) : null,
    own_model: simulated ? readOwnModelFields(view, at + DEFLECTION_SIZE) : null,
  };
  check(sample);
  checkInteger("seq of a contact sample", sample.seq, 1, U32);
  checkInteger("tick of a contact sample", sample.tick, 0, U32);
  const { anchor, deflection, own_model: hand } = sample;
  if (anchor !== null) checkVector("anchor", anchor, MAX_POSITION, "m");
  if (deflection !== null) checkRange("deflection", deflection, -MAX_POSITION, MAX_POSITION);
  if (hand !== null) checkFinite("own_model", hand.mass, hand.damping, hand.stiffness);
  return sample;
}

/** Check what the laws have computed; the loop has checked the anchor, and the rest of what is sent is the page's own. */
function check(sample: ContactSample): void {
  checkFinite("t_client", sample.t_client);
  checkVector("probe", sample.probe, MAX_POSITION, "m");
  checkVector("force", sample.force, MAX_FORCE, "N");
}
