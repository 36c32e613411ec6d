/** Entry point: opens the page on the server that delivered it. */

import { here, Invitation } from "./page/invitation";
// Before the page: like code then lies together, and the bundle is smaller (tests/bundle.test.ts).
import { PANELS } from "./panels/list";
import { Page } from "./page/page";
import { KEY, prepareTouch, startTouch } from "./touch/handle";
import { openWatch } from "./watch/connection";

const invitation = new Invitation(here());
// Another invitation in the same tab changes only the part of the address behind the #.
addEventListener("hashchange", () => {
  if (invitation.read()) location.reload();
});
const address = location.href;
if (location.search.startsWith("?session")) void import("./session/start").then(({ start }) => start(address)); // `cohaptic replay`
else new Page({
  address,
  openStore: () => openWatch(address, "forces", 30, invitation),
  startTouch: (settings, beside) => {
    // A session has one seat, which is the visitor's own.
    const token = beside ? invitation.invitation : invitation.token;
    return startTouch({ ...settings, ...(token && { token }) }, beside);
  },
  prepareTouch,
  invited: () => invitation.token !== undefined,
  invitation: () => invitation.invitation,
  misplaced: invitation.misplaced,
  key: KEY,
}, PANELS);
// A page that shows this one in a frame, such as a notebook, cannot see by itself whether the browser refused it. Without
// a frame this goes to the page itself, which does not listen.
parent.postMessage("cohaptic", "*");
