/** Opens the page on a recorded session, which `cohaptic replay` serves. */

import { greenUrl } from "../address";
import { decodeRestMesh } from "../protocol/rest_mesh";
import { Page } from "../page/page";
import { el } from "../ui/dom";
import { adopt } from "../ui/styles";
import { decodeOverview } from "./overview";
import { sessionPanels } from "./panels";
import styles from "./session.css?inline";
import { SessionStore } from "./store";

/** @param address Address of the page, http:. */
export async function start(address: string): Promise<void> {
  adopt(styles);
  try {
    await open(address);
  } catch (error) {
    // What `fetch` throws where nobody answers.
    const why = error instanceof TypeError ? "Its server does not answer; is it still running?" : `Its server said: ${error instanceof Error ? error.message : String(error)}.`;
    document.body.append(el("p", { class: "session-failed", text: `The recorded session cannot be shown. ${why}`, attrs: { role: "alert" } }));
  }
}

async function open(address: string): Promise<void> {
  const ask = (path: string): Promise<Response> => answered(new URL(path, address).href);
  const [said, mesh] = await Promise.all([ask("session.json").then((r) => r.text()), ask("session/mesh").then((r) => r.arrayBuffer())]);
  const overview = decodeOverview(said);
  const { first, last } = overview;
  const store = new SessionStore(overview, decodeRestMesh(new Uint8Array(mesh)), {
    scenes: async (from, to) => (await ask(`session/scenes?from=${from}&to=${to}`)).arrayBuffer(),
    green: (model) => async (vertices) => (await answered(greenUrl(address, model, vertices))).arrayBuffer(),
    now: () => performance.now() / 1000,
  }, Math.min(last, first + Math.max(0, Number(new URL(address).searchParams.get("t")) || 0)));
  document.title = `${overview.name} \u2013 cohaptic`;
  const page = new Page({
    address,
    openStore: () => store,
    startTouch: () => { throw new Error("nobody touches a recorded session"); },
    prepareTouch: () => undefined,
    invited: () => false,
    invitation: () => undefined,
    misplaced: false,
    key: "",
  }, sessionPanels(store, { ...overview, began: first + overview.watching.to_wall }, (t) => store.unshown(t), async (user, t) => (await ask(`session/why?user=${user}&t=${t}`)).text()));
  page.root.classList.add("of-session");
  page.lookBack(false);
}

async function answered(url: string): Promise<Response> {
  const response = await fetch(url);
  if (!response.ok) throw new Error((await response.text()).trim() || `${response.status}`);
  return response;
}
