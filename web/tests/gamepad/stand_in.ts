/** A gamepad and a time that a test makes. */

import { LOOK, PadLink } from "../../src/gamepad/link";

import type { HidDevice } from "../../src/gamepad/webhid";
import { toHex } from "../vectors";


/** A DualSense by cable, which keeps what it is told. */
export class StandIn implements HidDevice {
  opened = true;
  readonly vendorId = 0x054c;
  readonly productId = 0x0ce6;
  readonly productName = "DualSense";
  readonly collections = [];
  oninputreport: HidDevice["oninputreport"] = null;
  /** Time and bytes of each report to it, with its id. */
  readonly told: { readonly t: number; readonly hex: string }[] = [];
  /** Whether it is there, and whether it answers what is sent. */
  there = true;
  answers = true;
  now = 0;

  open(): Promise<void> {
    return Promise.resolve();
  }

  close(): Promise<void> {
    this.opened = false;
    return Promise.resolve();
  }

  sendReport(id: number, data: Uint8Array<ArrayBuffer>): Promise<void> {
    if (!this.there) return Promise.reject(new Error("gone"));
    this.told.push({ t: this.now, hex: toHex(Uint8Array.from([id, ...data])) });
    return this.answers ? Promise.resolve() : new Promise(() => undefined);
  }

  /** Report a pull of the trigger, and both sticks at rest. */
  say(pull: number, right_y = 128): void {
    const data = new Uint8Array(63).fill(128);
    data[3] = right_y;
    data[5] = pull;
    this.speak(1, data);
  }

  speak(id: number, data: Uint8Array<ArrayBuffer>): void {
    this.oninputreport?.({ reportId: id, data: new DataView(data.buffer) });
  }

  /** Resistance and rumble that it has now. */
  get has(): { readonly resistance: number; readonly rumble: number } {
    const hex = this.told.at(-1)?.hex ?? "";
    const byte = (at: number): number => parseInt(hex.slice(2 * at, 2 * at + 2) || "0", 16);
    return { resistance: byte(11) === 1 ? byte(13) : 0, rumble: byte(3) };
  }
}

/** A pad on its link, in virtual time. */
export class Bench {
  readonly device = new StandIn();
  now = 10;
  readonly link: PadLink;
  private look: (() => void) | null = null;

  constructor() {
    this.device.now = this.now;
    this.link = new PadLink(this.device, {
      now: () => this.now,
      every: (_, action) => {
        this.look = action;
        return () => { this.look = null; };
      },
    });
  }

  /** Go on by a while, with what is to happen at each look. */
  async pass(seconds: number, at_each: () => void = () => undefined): Promise<void> {
    for (let k = 0; k < Math.round(seconds / LOOK); k += 1) {
      this.now += LOOK;
      this.device.now = this.now;
      at_each();
      this.look?.();
      await Promise.resolve();
      await Promise.resolve();
    }
  }
}

