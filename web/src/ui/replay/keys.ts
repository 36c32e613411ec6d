/** Keys of a replay, loaded with the replay's code. */

/** Actions of keys while the page shows a past time. */
export type ReplayAction = "play" | "back" | "on" | "far back" | "far on" | "first" | "last" | "live" | "next" | "previous" | "none";

/** Keys of the page that do nothing where there is no room: touch, tour, last minute, point, follow, and depth. */
const OF_ROOMS: readonly string[] = ["t", "g", "b", "p", "v", "[", "]", ",", ".", "Escape"];

/**
 * The action of a key in a replay; null where it belongs to a field, a button or the page.
 *
 * @param session Whether a recorded session is shown.
 */
export function replayActionOf(
  { key, shiftKey, ctrlKey, metaKey, altKey }: Pick<KeyboardEvent, "key" | "shiftKey" | "ctrlKey" | "metaKey" | "altKey">,
  target: { readonly tagName: string; readonly type?: string } | null,
  session = false,
): ReplayAction | null {
  if (ctrlKey || metaKey || altKey) return null;
  const tag = target?.tagName ?? "";
  // The timeline is a field of its own kind: its keys are those of the replay.
  if (tag === "TEXTAREA" || tag === "SELECT" || (tag === "INPUT" && target?.type !== "range")) return key === "Escape" && !session ? "live" : null;
  if (session) {
    if (key.toLowerCase() === "n") return shiftKey ? "previous" : "next";
    if (OF_ROOMS.includes(key.length === 1 ? key.toLowerCase() : key)) return "none";
  }
  switch (key) {
    case " ": return tag === "BUTTON" ? null : "play";
    case "ArrowLeft": return shiftKey ? "far back" : "back";
    case "ArrowRight": return shiftKey ? "far on" : "on";
    case "Home": return "first";
    case "End": return "last";
    case "Escape": return "live";
    default: return null;
  }
}
