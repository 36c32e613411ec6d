/**
 * Connection to the pad: takes the newest report, and sends one when effects change, at a bounded rate.
 *
 * It is also a watchdog: it switches resistance and rumble off when the page gives no effects or the pad sends no reports.
 * Clock and timer are arguments, so that a test can set the time.
 */

import { decode, type Effects, encode, type Held, OFF, OUTPUT, sameEffects } from "./reports";
import type { HidDevice } from "./webhid";

export const PAGE_SILENCE = 0.1; // s; longest silence of the page, which draws sixty times a second where it can
export const PAD_SILENCE = 0.05; // s; longest silence of the pad, which reports every 4 ms; a page that draws hears it late
export const LEAST_GAP = 0.01; // s between two reports to the pad
export const LOOK = 0.005; // s between two checks
const LONGEST_WRITE = 0.25; // s; a pad that takes longer for a report counts as one that takes none
const MOST_BAD = 20; // invalid reports in a row

const UNPLUGGED = "The gamepad was unplugged.";
const FOREIGN = "What this gamepad sends is no report of a DualSense by cable. Connect it by cable; Bluetooth is not supported.";
const DEAF = "The gamepad takes no reports. Unplug it and plug it in again.";

export interface PadWorld {
  /** Time on the page's clock [s]. */
  now(): number;
  /** Calls `action` again and again; returns a function that ends that. */
  every(seconds: number, action: () => void): () => void;
}

export class PadLink {
  /** Reason why the pad cannot be used, in words; empty for none. */
  trouble = "";
  private told: Held | null = null;
  private heard: number;
  private given: { readonly effects: Effects; readonly at: number };
  private sent: Effects | null = null; // null until a report has gone to the pad
  private written = -Infinity;
  private writing = false;
  private bad = 0;
  private ended = false;
  private readonly stop: () => void;

  /** @param device Open device; this object closes it. */
  constructor(private readonly device: HidDevice, private readonly world: PadWorld) {
    this.heard = world.now();
    this.given = { effects: OFF, at: this.heard };
    device.oninputreport = ({ reportId, data }) => { this.hear(decode(reportId, data)); };
    this.stop = world.every(LOOK, () => { this.look(); });
  }

  /** The newest report since the last call. */
  poll(): Held | null {
    const told = this.told;
    this.told = null;
    return told;
  }

  /** Apply these effects until the page has been silent for too long. */
  give(effects: Effects): void {
    this.given = { effects, at: this.world.now() };
  }

  /** Switch all effects off at once, because a page that goes to sleep gets no other chance. */
  still(): void {
    this.give(OFF);
    if (!this.ended && !this.writing && (this.sent === null || !sameEffects(this.sent, OFF))) this.write(OFF);
  }

  /** The browser says that the pad is gone. */
  disconnected(): void {
    this.fail(UNPLUGGED);
  }

  /** Switch all effects off, twice, then release the pad; may be called twice. */
  async close(): Promise<void> {
    if (this.ended) return;
    this.ended = true;
    this.stop();
    this.device.oninputreport = null;
    // The second is sent even if the first fails: it may succeed.
    for (let k = 0; k < 2; k += 1) await this.device.sendReport(OUTPUT, encode(OFF)).catch(() => undefined);
    await this.device.close().catch(() => undefined);
  }

  private hear(held: Held | null): void {
    this.bad = held === null ? this.bad + 1 : 0;
    if (this.bad >= MOST_BAD) this.fail(FOREIGN);
    if (held === null) return;
    this.told = held;
    this.heard = this.world.now();
  }

  private look(): void {
    const now = this.world.now();
    if (this.writing && now - this.written > LONGEST_WRITE) this.fail(DEAF);
    const silent = now - this.given.at > PAGE_SILENCE || now - this.heard > PAD_SILENCE;
    const effects = silent || this.trouble !== "" ? OFF : this.given.effects;
    if (this.writing || now - this.written < LEAST_GAP) return;
    if (this.sent === null || !sameEffects(effects, this.sent)) this.write(effects);
  }

  private write(effects: Effects): void {
    this.writing = true;
    this.written = this.world.now();
    this.device.sendReport(OUTPUT, encode(effects)).then(
      () => {
        this.writing = false;
        this.sent = effects;
      },
      () => {
        this.writing = false;
        this.fail(UNPLUGGED);
      },
    );
  }

  private fail(words: string): void {
    if (this.trouble === "") this.trouble = words;
  }
}
