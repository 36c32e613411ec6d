/** The place of a dialog on the page; the dialog's code is loaded when it is first opened. */

import { el } from "./dom";
import { lazily } from "./lazy";

interface Dialog {
  readonly root: HTMLDialogElement;
  toggle(): void;
}

export class LazyDialog {
  readonly root = el("div");
  private dialog: Dialog | null = null;
  private readonly fetch: () => void;

  constructor(load: () => Promise<Dialog>) {
    this.fetch = lazily(load, (dialog) => {
      this.dialog = dialog;
      this.root.append(dialog.root);
      dialog.toggle();
    });
  }

  get open(): boolean {
    return this.dialog?.root.open === true;
  }

  toggle(): void {
    this.dialog?.toggle();
    this.fetch();
  }
}
