/** The place of a gamepad on the page: a button if the browser has WebHID; the gamepad's code is loaded at the first press. */

import { type Hid, webHid } from "../../gamepad/webhid";
import { el, iconButton } from "../dom";
import { icon } from "../icons";
import type { GamepadDesk, PadHost } from "./desk";

export class GamepadPlace {
  readonly root = el("div");
  readonly button: HTMLButtonElement;
  private readonly hid: Hid | null = webHid(navigator);
  private desk: GamepadDesk | null = null;
  private loading = false;

  constructor(private readonly host: PadHost) {
    this.button = iconButton(icon("gamepad"), "Use a gamepad", "", () => { this.open(); });
    this.button.hidden = this.hid === null;
    addEventListener("pagehide", () => { this.desk?.pause(); });
  }

  /** Whether a gamepad moves the hand, and gives the hand's force by its own motors. */
  get used(): boolean {
    return this.desk?.used === true;
  }

  frame(now: number): void {
    this.desk?.frame(now);
  }

  /** The page goes to the background. */
  pause(): void {
    this.desk?.pause();
  }

  private open(): void {
    const { hid, host } = this;
    if (this.desk !== null) this.desk.toggle();
    if (hid === null || this.loading) return;
    this.loading = true;
    import("./desk").then(({ GamepadDesk }) => {
      this.desk = new GamepadDesk(hid, host);
      this.root.append(this.desk.root);
      this.desk.toggle();
    }, () => {
      this.loading = false; // the code can be requested again
    });
  }
}
