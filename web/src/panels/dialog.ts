/** A dialog as a panel: its code is loaded when a button or a key first asks for it. */

import type { Panel, PanelHost } from "../page/panels";
import { el } from "../ui/dom";
import { lazily } from "../ui/lazy";

interface Dialog {
  readonly root: HTMLDialogElement;
  toggle(): void;
}

export function dialog(id: string, load: (page: PanelHost) => Promise<Dialog>): Panel {
  return {
    id,
    mount: (page, put) => {
      let dialog: Dialog | null = null;
      const place = el("div");
      const fetch = lazily(() => load(page), (made) => {
        dialog = made;
        place.append(made.root);
        made.toggle();
      });
      put("dialogs", place);
      return {
        toggle: () => {
          dialog?.toggle();
          fetch();
        },
      };
    },
  };
}
