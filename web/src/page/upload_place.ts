/** The upload's place on the page; its code is loaded if the server accepts files. */

import { el } from "../ui/dom";
import type { UploadDesk } from "../ui/upload/desk";

export class UploadPlace {
  readonly root = el("div");
  private desk: UploadDesk | null = null;
  private loading = false;
  private allowed = false;

  /**
   * @param address Address of the server, http: or https:.
   * @param touch Brings the visitor's hand into the room.
   */
  constructor(private readonly address: string, private readonly touch: () => void) {}

  /** Set whether the server accepts files. */
  allow(allowed: boolean): void {
    this.allowed = allowed;
    this.desk?.allow(allowed);
    if (!allowed || this.loading) return;
    this.loading = true;
    import("../ui/upload/desk").then(({ UploadDesk }) => {
      this.desk = new UploadDesk(this.address, this.touch);
      this.root.append(this.desk.dialog.root);
      this.desk.allow(this.allowed);
    }, () => {
      this.loading = false; // the code can be requested again
    });
  }

  open(): void {
    this.desk?.open();
  }
}
