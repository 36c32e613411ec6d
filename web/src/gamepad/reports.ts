/**
 * Pure functions that decode and encode the reports of a DualSense over USB.
 *
 * `client/cohaptic_drivers/dualsense/reports.py` in TypeScript, for the right trigger.
 */

export const VENDOR = 0x054c;
export const PRODUCTS = [0x0ce6, 0x0df2] as const; // DualSense, DualSense Edge
export const OUTPUT = 0x02; // id of a report to the pad
export const MOST = 255; // full scale of a byte
export const BLUETOOTH = 0x31; // id of a report from a pad on Bluetooth, which has another layout
const USB = 0x01;
const SIZE = 64; // bytes of a report from the pad, with its id
const OUTPUT_SIZE = 48; // bytes of a report to the pad
const RUMBLE = 0x01 | 0x02; // flags: the report sets the rumble, and the motors do it
const [PULL, FLAG, BLOCK] = [6, 0x04, 11]; // of the right trigger: byte of its pull, its flag, first byte of its effect
const [OFF_MODE, RESISTANCE] = [0x05, 0x01];
const CENTRE = 128; // approximate centre of a stick

/** State of sticks, trigger and buttons. */
export interface Held {
  /** Sticks, to the right and up, each -1 to 1. */
  readonly left: readonly [number, number];
  readonly right: readonly [number, number];
  /** Pull of the trigger, 0 to 255. */
  readonly pull: number;
  /** A bit for each button that is held, as in Python. */
  readonly buttons: number;
}

/** Effects of the pad, each 0 to 255: pull at which the trigger begins to resist, its resistance, and rumble of both motors. */
export interface Effects {
  readonly start: number;
  readonly resistance: number;
  readonly rumble: number;
}

export const NOTHING_HELD: Held = { left: [0, 0], right: [0, 0], pull: 0, buttons: 0 };
export const OFF: Effects = { start: 0, resistance: 0, rumble: 0 };

export function sameEffects(a: Effects, b: Effects): boolean {
  return a.start === b.start && a.resistance === b.resistance && a.rumble === b.rumble;
}

/** Decode a report without its id; null for one that is unknown or of another length. */
export function decode(id: number, data: DataView): Held | null {
  if (id !== USB || data.byteLength !== SIZE - 1) return null;
  const byte = (at: number): number => data.getUint8(at - 1); // places as in the table, where the id is byte 0
  return {
    left: [share(byte(1)), -share(byte(2))],
    right: [share(byte(3)), -share(byte(4))],
    pull: byte(PULL),
    buttons: (byte(8) >> 4) | (byte(9) << 4) | ((byte(10) & 0b111) << 12),
  };
}

/** Encode a report with these effects, without its id; the other trigger and the lights stay as they are. */
export function encode(effects: Effects): Uint8Array<ArrayBuffer> {
  const data = new Uint8Array(OUTPUT_SIZE);
  data[1] = RUMBLE | FLAG;
  data[3] = data[4] = clamped(effects.rumble);
  const resistance = clamped(effects.resistance);
  data[BLOCK] = resistance > 0 ? RESISTANCE : OFF_MODE;
  if (resistance > 0) data.set([clamped(effects.start), resistance], BLOCK + 1);
  return data.slice(1);
}

function share(raw: number): number {
  return Math.max(-1, Math.min(1, (raw - CENTRE) / (MOST - CENTRE)));
}

function clamped(value: number): number {
  return Math.max(0, Math.min(MOST, value));
}
