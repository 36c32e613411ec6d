/** Keys of the page, as a table; the help has the words for each. */

export type KeyAction =
  | "left" | "right" | "up" | "down" | "closer" | "farther" | "reset" | "full" | "touch" | "press" | "deeper" | "shallower"
  | "tour" | "replay" | "delay" | "point" | "follow" | "theme" | "help" | "escape";

interface Shortcut {
  readonly keys: readonly string[];
  readonly action: KeyAction;
}

export const SHORTCUTS: readonly Shortcut[] = [
  { keys: ["ArrowLeft"], action: "left" },
  { keys: ["ArrowRight"], action: "right" },
  { keys: ["ArrowUp"], action: "up" },
  { keys: ["ArrowDown"], action: "down" },
  { keys: ["+", "="], action: "closer" },
  { keys: ["-", "_"], action: "farther" },
  { keys: ["r"], action: "reset" },
  { keys: ["f"], action: "full" },
  { keys: ["t"], action: "touch" },
  { keys: [" "], action: "press" },
  { keys: ["]", "."], action: "deeper" },
  { keys: ["[", ","], action: "shallower" },
  { keys: ["g"], action: "tour" },
  { keys: ["b"], action: "replay" },
  { keys: ["l"], action: "delay" },
  { keys: ["p"], action: "point" },
  { keys: ["v"], action: "follow" },
  { keys: ["d"], action: "theme" },
  { keys: ["?"], action: "help" },
  { keys: ["Escape"], action: "escape" },
];

/** The action of a key; null where the key belongs to a field, a button or the browser. */
export function actionOf(
  event: Pick<KeyboardEvent, "key" | "ctrlKey" | "metaKey" | "altKey">,
  target: { readonly tagName: string; readonly type?: string } | null,
): KeyAction | null {
  if (event.ctrlKey || event.metaKey || event.altKey) return null;
  const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
  const shortcut = SHORTCUTS.find((s) => s.keys.includes(key));
  if (shortcut === undefined) return null;
  const tag = target?.tagName ?? "";
  if (tag === "INPUT" || tag === "TEXTAREA" || tag === "SELECT") {
    const typing = tag !== "INPUT" || target?.type === "text";
    const moves = shortcut.action === "press" || key.startsWith("Arrow");
    if (typing ? shortcut.action !== "escape" : moves) return null;
  }
  // Space on a button presses the button.
  if (tag === "BUTTON" && shortcut.action === "press") return null;
  return shortcut.action;
}
