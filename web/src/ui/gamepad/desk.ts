/** The visitor's gamepad: its dialog, its connection to the hand, and the words when it ends. */

import { choosePad, NoPad } from "../../gamepad/choose";
import { PadLink } from "../../gamepad/link";
import { type Felt, Pad, type Sphere } from "../../gamepad/pad";
import type { Hid, HidDevice } from "../../gamepad/webhid";
import type { Vec3 } from "../../model/vec";
import { el, say, show } from "../dom";
import { icon } from "../icons";

const LET_GO = "Your hand was let go.";
const READY = "The gamepad is in use. Let go of its trigger once, then press with it.";

/** The functions of the page that a gamepad uses. */
export interface PadHost {
  /** Bring the hand into the room. */
  touch(): void;
  /** Direction from the middle of the body to the eye. */
  towardsEye(): Vec3;
  /** The body; null before it is known. */
  body(): Sphere | null;
  /** Newest report of the hand; null while it is not in the room. */
  felt(): Felt | null;
  /** Set the target of the hand [m]; null leaves the target to pointers and keys again. */
  steer(target: Vec3 | null): void;
}

export class GamepadDesk {
  readonly root: HTMLDialogElement;
  private link: PadLink | null = null;
  private device: HidDevice | null = null;
  private pad: Pad | null = null;
  private choosing = false;
  private readonly words = el("p", { class: "fine", attrs: { role: "status" } });
  private readonly chooser: HTMLButtonElement;
  private readonly stopper: HTMLButtonElement;

  constructor(private readonly hid: Hid, private readonly host: PadHost) {
    const press = (text: string, kind: string, act: () => void): HTMLButtonElement =>
      el("button", { class: `button ${kind}`, text, attrs: { type: "button" }, on: { click: act } });
    this.chooser = press("Choose a gamepad\u2026", "primary", () => void this.choose());
    this.stopper = press("Stop using it", "", () => { this.end("The gamepad is no longer in use."); });
    this.root = el("dialog", { class: "dialog", attrs: { "aria-labelledby": "gamepad-title" } },
      el("button", { class: "icon-button dialog-close", attrs: { type: "button", "aria-label": "Close" }, on: { click: () => { this.root.close(); } } }, icon("close")),
      el("h2", { id: "gamepad-title", text: "Use a gamepad" }),
      el("p", {
        text: "A Sony DualSense, connected by cable. The trigger R2 presses into the object and resists as the object does; letting it go lifts "
          + "your hand off. The left stick moves your hand sideways, the right one toward the object and back. What changes quickly rumbles.",
      }),
      el("p", { text: "A trigger resists and cannot push, and nobody has measured it in newtons." }),
      el("div", { class: "gamepad-buttons" }, this.chooser, " ", this.stopper), this.words);
    this.root.addEventListener("click", (event) => {
      if (event.target === this.root) this.root.close();
    });
    show(this.stopper, false);
    hid.ondisconnect = ({ device }) => { this.disconnected(device); };
  }

  /** Whether a gamepad moves the hand. */
  get used(): boolean {
    return this.link !== null;
  }

  toggle(): void {
    if (this.root.open) this.root.close();
    else this.root.showModal();
  }

  /** Move the hand on; to be called for each frame. */
  frame(now: number): void {
    const { link, host } = this;
    const body = host.body();
    if (link === null || body === null) return;
    if (this.pad?.body !== body) this.pad = new Pad(link, body, host.towardsEye());
    const target = this.pad.step(now, host.felt());
    if (this.pad.trouble !== "") this.end(`${this.pad.trouble} ${LET_GO}`);
    else host.steer(target);
  }

  /** The page goes to the background. */
  pause(): void {
    if (this.pad === null) this.link?.still();
    else {
      this.host.steer(this.pad.out);
      this.pad.pause();
    }
  }

  private async choose(): Promise<void> {
    if (this.choosing || this.used) return; // two presses of the button in a row
    this.choosing = true;
    try {
      const device = await choosePad(this.hid);
      this.device = device;
      this.link = new PadLink(device, {
        now: () => performance.now() / 1000,
        every: (seconds, action) => {
          const timer = setInterval(action, 1000 * seconds);
          return () => { clearInterval(timer); };
        },
      });
    } catch (error) {
      if (!(error instanceof NoPad)) throw error;
      say(this.words, error.message);
      return;
    } finally {
      this.choosing = false;
    }
    this.tell(READY);
    this.host.touch();
  }

  private disconnected(device: HidDevice): void {
    if (device === this.device) this.link?.disconnected();
  }

  /** Move the hand off the body, and release the pad. */
  release(): void {
    const { link, pad } = this;
    [this.link, this.pad, this.device] = [null, null, null];
    if (pad !== null) this.host.steer(pad.out);
    this.host.steer(null);
    void link?.close();
  }

  private end(words: string): void {
    this.release();
    this.tell(words);
    // The reason is written in the dialog, so a closed dialog opens to show it.
    if (!this.root.open && document.querySelector("dialog[open]") === null) this.root.showModal();
  }

  private tell(words: string): void {
    say(this.words, words);
    show(this.chooser, !this.used);
    show(this.stopper, this.used);
  }
}
