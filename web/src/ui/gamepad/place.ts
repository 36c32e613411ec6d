/** The place of a gamepad on the page: a button if the browser has WebHID; the gamepad's code is loaded at the first press. */

import { type Hid, webHid } from "../../gamepad/webhid";
import { el, iconButton } from "../dom";
import { icon } from "../icons";
import { lazily } from "../lazy";
import type { GamepadDesk, PadHost } from "./desk";

export class GamepadPlace {
  readonly root = el("div");
  readonly button: HTMLButtonElement;
  private readonly hid: Hid | null = webHid(navigator);
  private desk: GamepadDesk | null = null;

  constructor(host: PadHost) {
    const load = lazily(() => import("./desk"), ({ GamepadDesk }) => {
      if (this.hid === null) return;
      this.desk = new GamepadDesk(this.hid, host);
      this.root.append(this.desk.root);
      this.desk.toggle();
    });
    this.button = iconButton(icon("gamepad"), "Use a gamepad", "", () => {
      this.desk?.toggle();
      load();
    });
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
}
