/** The dock at the foot of the stage: controls and force of the visitor's hand. */

import type { Panel } from "../page/panels";
import { Dock } from "../ui/dock";

export const dock: Panel = {
  id: "dock",
  mount: (page, put) => {
    const { own, root, store, visitor } = page;
    let { name } = visitor;
    const box = new Dock(name, {
      touch: (on) => { page.touch(on); },
      law: (law) => { own.setLaw(law); },
      friction: (mu) => { own.setFriction(mu); },
      name: (typed) => { own.rename(name = visitor.choose(typed)); },
    });
    put("foot", box.root, true);
    return {
      update: () => {
        const { info } = store;
        const { state } = own;
        // The room may have refused the name that was typed.
        if (name !== visitor.name) box.setName(name = visitor.name);
        box.setLaw(own.law);
        box.allow(info?.can_touch !== false, info?.allow_fixed_gains === true);
        // Elements over the stage stay clear of the dock.
        root.style.setProperty("--foot", `${box.root.offsetHeight}px`);
        root.style.setProperty("--dock", `${box.height}px`);
        box.set(own.handle !== null, own.hint(page.replay.active));
        if (state !== null) box.update(state, page.live, page.colour(state.user), page.inks());
      },
    };
  },
};
