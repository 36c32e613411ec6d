/** The notice over the stage: the most urgent trouble of the connection, the hand or the browser. */

import type { Panel, PanelHost } from "../page/panels";
import { notice as choose, type NoticeFacts } from "../ui/notice";
import { NoticeBar } from "../ui/notice_bar";

export const notice: Panel = {
  id: "notice",
  mount: (page, put) => {
    const bar = new NoticeBar(() => { location.reload(); }, () => { page.touch(true, true); });
    put("stack", bar.root);
    return { update: (now) => { bar.set(choose(factsOf(page, now))); } };
  },
};

function factsOf(page: PanelHost, now: number): NoticeFacts {
  const { own, store: { restraints, status: { phase, reason, retry_at, code, silent } } } = page;
  const hand = own.ended ?? own.state;
  const joined = hand?.phase === "joined";
  return {
    ...page.trouble(now),
    clockStep: own.handle?.link.clock_step ?? 0,
    phase,
    code,
    reason,
    retryIn: Math.max(0, retry_at - now),
    silent,
    touch: hand !== null && !joined ? hand.reason : "",
    touchCode: hand?.code ?? 0,
    nameRefused: hand?.phase === "closed" ? "" : (hand?.name_refused ?? ""),
    muted: joined && restraints.muted.includes(hand.user),
    frozen: joined && restraints.frozen,
  };
}
