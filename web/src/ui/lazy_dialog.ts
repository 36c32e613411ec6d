/** The place of a dialog on the page; the dialog's code is loaded when it is first opened. */

import { el } from "./dom";

interface Dialog {
  readonly root: HTMLDialogElement;
  toggle(): void;
}

export class LazyDialog {
  readonly root = el("div");
  private dialog: Dialog | null = null;
  private loading = false;

  constructor(private readonly load: () => Promise<Dialog>) {}

  get open(): boolean {
    return this.dialog?.root.open === true;
  }

  toggle(): void {
    if (this.dialog !== null) {
      this.dialog.toggle();
      return;
    }
    if (this.loading) return;
    this.loading = true;
    this.load().then((dialog) => {
      this.dialog = dialog;
      this.root.append(dialog.root);
      dialog.toggle();
    }, () => {
      this.loading = false; // the code can be requested again
    });
  }
}
