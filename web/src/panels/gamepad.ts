/** A gamepad as the visitor's hand, if the browser has WebHID, and the force as rumble of any gamepad or phone. */

import { webHid } from "../gamepad/webhid";
import type { Panel } from "../page/panels";
import { el, iconButton } from "../ui/dom";
import type { GamepadDesk } from "../ui/gamepad/desk";
import { icon } from "../ui/icons";
import { lazily } from "../ui/lazy";
import type { Rumble } from "../ui/rumble";

export const gamepad: Panel = {
  id: "gamepad",
  mount: (page, put) => {
    const hid = webHid(navigator);
    let desk: GamepadDesk | null = null;
    let rumble: Rumble | null = null;
    const place = el("div");
    const fetch = lazily(() => import("./pad"), ({ openDesk }) => {
      if (hid === null) return;
      desk = openDesk(hid, page);
      place.append(desk.root);
      desk.toggle();
    });
    const button = iconButton(icon("gamepad"), "Use a gamepad", "", () => {
      desk?.toggle();
      fetch();
    });
    button.hidden = hid === null;
    put("tools", button);
    put("dialogs", place);
    lazily(() => page.graphics.then(() => import("../ui/rumble")), ({ Rumble }) => { rumble = new Rumble(); })();
    return {
      rest: () => { desk?.pause(); },
      paint: (now) => {
        desk?.frame(now);
        // A gamepad that moves the hand gives the force by its own motors.
        if (desk?.used !== true) rumble?.feel(page.own.state?.force ?? [0, 0, 0], 1000 * now);
      },
      dispose: () => { desk?.release(); },
    };
  },
};
