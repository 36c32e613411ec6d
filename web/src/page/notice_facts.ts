/** Collects the facts on which the choice of a notice depends. */

import type { TouchState } from "../model/hand";
import type { SceneStore } from "../model/scene";
import type { NoticeFacts } from "../ui/notice";

export function noticeFacts(
  store: Pick<SceneStore, "status" | "restraints">,
  own: TouchState | null,
  page: Pick<NoticeFacts, "picture" | "misplaced" | "clockStep" | "seen" | "slept" | "letGo"> & { readonly now: number },
): NoticeFacts {
  const { phase, reason, retry_at, code, silent } = store.status;
  return {
    picture: page.picture,
    misplaced: page.misplaced,
    clockStep: page.clockStep,
    phase,
    code,
    reason,
    retryIn: Math.max(0, retry_at - page.now),
    silent,
    seen: page.seen,
    slept: page.slept,
    letGo: page.letGo,
    touch: own !== null && own.phase !== "joined" ? own.reason : "",
    touchCode: own?.code ?? 0,
    nameRefused: own?.phase === "closed" ? "" : (own?.name_refused ?? ""),
    muted: own?.phase === "joined" && store.restraints.muted.includes(own.user),
    frozen: own?.phase === "joined" && store.restraints.frozen,
  };
}
