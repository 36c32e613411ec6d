/** The help's place on the page: its words come over the network when they are asked for. */

import { el } from "./dom";
import type { Help } from "./help";

export class HelpPlace {
  readonly root = el("div");
  private help: Help | null = null;
  private loading = false;

  get open(): boolean {
    return this.help?.root.open === true;
  }

  toggle(): void {
    if (this.help !== null) {
      this.help.toggle();
      return;
    }
    if (this.loading) return;
    this.loading = true;
    import("./help").then(({ Help }) => {
      this.help = new Help();
      this.root.append(this.help.root);
      this.help.toggle();
    }, () => {
      this.loading = false; // to be asked for again
    });
  }
}
