/** A visitor's own object: a button and a dialog, whose code is loaded if the server accepts files. */

import type { Panel } from "../page/panels";
import { el, iconButton, show } from "../ui/dom";
import { icon } from "../ui/icons";
import { lazily } from "../ui/lazy";
import type { UploadDesk } from "../ui/upload/desk";

export const upload: Panel = {
  id: "upload",
  mount: (page, put) => {
    let desk: UploadDesk | null = null;
    const place = el("div");
    const button = iconButton(icon("upload"), "An object of your own", "", () => { desk?.open(); });
    const update = (): void => {
      const allowed = page.store.info?.allow_upload === true;
      show(button, allowed);
      desk?.allow(allowed);
      if (allowed) fetch();
    };
    const fetch = lazily(() => import("../ui/upload/desk"), ({ UploadDesk }) => {
      desk = new UploadDesk(page.settings.address, () => { page.touch(true); });
      place.append(desk.dialog.root);
      update(); // a file may be dropped at once
    });
    put("tools", button);
    put("dialogs", place);
    return {
      update,
      dispose: () => { desk?.allow(false); },
    };
  },
};
