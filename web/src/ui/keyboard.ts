/** Keys of the page, as a table that the help shows too. */

export type KeyAction =
  | "left" | "right" | "up" | "down" | "closer" | "farther" | "reset" | "full" | "touch" | "press" | "deeper" | "shallower"
  | "tour" | "theme" | "help" | "escape";

interface Shortcut {
  readonly keys: readonly string[];
  readonly shown: string;
  readonly words: string;
  readonly action: KeyAction;
}

export const SHORTCUTS: readonly Shortcut[] = [
  { keys: ["ArrowLeft"], shown: "\u2190 \u2192 \u2191 \u2193", words: "turn the view", action: "left" },
  { keys: ["ArrowRight"], shown: "", words: "", action: "right" },
  { keys: ["ArrowUp"], shown: "", words: "", action: "up" },
  { keys: ["ArrowDown"], shown: "", words: "", action: "down" },
  { keys: ["+", "="], shown: "+ \u2212", words: "closer, farther", action: "closer" },
  { keys: ["-", "_"], shown: "", words: "", action: "farther" },
  { keys: ["r"], shown: "R", words: "first view again", action: "reset" },
  { keys: ["f"], shown: "F", words: "full screen", action: "full" },
  { keys: ["t"], shown: "T", words: "touch, let go", action: "touch" },
  { keys: [" "], shown: "Space", words: "press in the middle of the view while held", action: "press" },
  { keys: ["]", "."], shown: "[ ]", words: "press less, more", action: "deeper" },
  { keys: ["[", ","], shown: "", words: "", action: "shallower" },
  { keys: ["g"], shown: "G", words: "guided tour", action: "tour" },
  { keys: ["d"], shown: "D", words: "day, night", action: "theme" },
  { keys: ["?"], shown: "?", words: "this list", action: "help" },
  { keys: ["Escape"], shown: "Esc", words: "close, let go", action: "escape" },
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
