/** The upload's place on the page; its code is loaded if the server accepts files. */

import { el } from "../ui/dom";
import { lazily } from "../ui/lazy";
import type { UploadDesk } from "../ui/upload/desk";

export class UploadPlace {
  readonly root = el("div");
  private desk: UploadDesk | null = null;
  private allowed = false;
  private readonly load: () => void;

  /**
   * @param address Address of the server, http: or https:.
   * @param touch Brings the visitor's hand into the room.
   */
  constructor(address: string, touch: () => void) {
    this.load = lazily(() => import("../ui/upload/desk"), ({ UploadDesk }) => {
      this.desk = new UploadDesk(address, touch);
      this.root.append(this.desk.dialog.root);
      this.desk.allow(this.allowed);
    });
  }

  /** Set whether the server accepts files. */
  allow(allowed: boolean): void {
    this.allowed = allowed;
    this.desk?.allow(allowed);
    if (allowed) this.load();
  }

  open(): void {
    this.desk?.open();
  }
}
