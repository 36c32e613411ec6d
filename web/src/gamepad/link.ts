/**
 * The way to the pad: newest report in, and a report out when something changes, at a bounded rate.
 *
 * It is a watchdog as well: a page that gives nothing, and a pad that tells nothing, get no resistance and no rumble.
 * Clock and timer are given, so that a test can be the time.
 */

import { decode, type Effects, encode, type Held, OFF, OUTPUT, sameEffects } from "./reports";
import type { HidDevice } from "./webhid";

export const PAGE_SILENCE = 0.1; // s; of the page, which draws sixty times a second where it can
export const PAD_SILENCE = 0.05; // s; of the pad, which reports every 4 ms; a page that draws hears it late
export const LEAST_GAP = 0.01; // s between two reports to the pad
export const LOOK = 0.005; // s between two looks
const LONGEST_WRITE = 0.25; // s; then it counts as one that takes nothing
const MOST_BAD = 20; // reports in a row that are none

const UNPLUGGED = "The gamepad was unplugged.";
const FOREIGN = "What this gamepad sends is no report of a DualSense by cable. Connect it by cable; Bluetooth is not supported.";
const DEAF = "The gamepad takes no reports. Unplug it and plug it in again.";

export interface PadWorld {
  /** On the page's clock [s]. */
  now(): number;
  /** Calls `action` again and again; returns how to end that. */
  every(seconds: number, action: () => void): () => void;
}

export class PadLink {
  /** What keeps the pad from use, in words; empty for nothing. */
  trouble = "";
  private told: Held | null = null;
  private heard: number;
  private given: { readonly effects: Effects; readonly at: number };
  private sent: Effects | null = null; // null until the pad was told anything
  private written = -Infinity;
  private writing = false;
  private bad = 0;
  private ended = false;
  private readonly stop: () => void;

  /** @param device Open; this object closes it. */
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

  /** Have the pad do this, until the page has been silent for too long. */
  give(effects: Effects): void {
    this.given = { effects, at: this.world.now() };
  }

  /** Nothing to be felt any more, at once: a page that goes to sleep gets no other chance. */
  still(): void {
    this.give(OFF);
    if (!this.ended && !this.writing && (this.sent === null || !sameEffects(this.sent, OFF))) this.write(OFF);
  }

  /** The browser says that the pad is gone. */
  disconnected(): void {
    this.fail(UNPLUGGED);
  }

  /** Nothing to be felt, twice, then release the pad; may be called twice. */
  async close(): Promise<void> {
    if (this.ended) return;
    this.ended = true;
    this.stop();
    this.device.oninputreport = null;
    // One that fails may be followed by one that does not.
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
