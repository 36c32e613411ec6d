/** Keys of the page, as a table that the help shows too. */

export type KeyDeed =
  | "left" | "right" | "up" | "down" | "closer" | "farther" | "reset" | "full" | "touch" | "press" | "deeper" | "shallower"
  | "tour" | "theme" | "help" | "escape";

interface Shortcut {
  readonly keys: readonly string[];
  readonly shown: string;
  readonly words: string;
  readonly deed: KeyDeed;
}

export const SHORTCUTS: readonly Shortcut[] = [
  { keys: ["ArrowLeft"], shown: "\u2190 \u2192 \u2191 \u2193", words: "turn the view", deed: "left" },
  { keys: ["ArrowRight"], shown: "", words: "", deed: "right" },
  { keys: ["ArrowUp"], shown: "", words: "", deed: "up" },
  { keys: ["ArrowDown"], shown: "", words: "", deed: "down" },
  { keys: ["+", "="], shown: "+ \u2212", words: "closer, farther", deed: "closer" },
  { keys: ["-", "_"], shown: "", words: "", deed: "farther" },
  { keys: ["r"], shown: "R", words: "first view again", deed: "reset" },
  { keys: ["f"], shown: "F", words: "full screen", deed: "full" },
  { keys: ["t"], shown: "T", words: "touch, let go", deed: "touch" },
  { keys: [" "], shown: "Space", words: "press in the middle of the view while held", deed: "press" },
  { keys: ["]", "."], shown: "[ ]", words: "press less, more", deed: "deeper" },
  { keys: ["[", ","], shown: "", words: "", deed: "shallower" },
  { keys: ["g"], shown: "G", words: "guided tour", deed: "tour" },
  { keys: ["d"], shown: "D", words: "day, night", deed: "theme" },
  { keys: ["?"], shown: "?", words: "this list", deed: "help" },
  { keys: ["Escape"], shown: "Esc", words: "close, let go", deed: "escape" },
];

/** What a key does; null where it belongs to something else: a field, a button, the browser. */
export function deedOf(
  event: Pick<KeyboardEvent, "key" | "ctrlKey" | "metaKey" | "altKey">,
  target: { readonly tagName: string; readonly type?: string } | null,
): KeyDeed | null {
  if (event.ctrlKey || event.metaKey || event.altKey) return null;
  const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
  const found = SHORTCUTS.find((s) => s.keys.includes(key));
  if (found === undefined) return null;
  const tag = target?.tagName ?? "";
  if (tag === "INPUT" || tag === "TEXTAREA" || tag === "SELECT") {
    const typing = tag !== "INPUT" || target?.type === "text";
    const moves = found.deed === "press" || key.startsWith("Arrow");
    if (typing ? found.deed !== "escape" : moves) return null;
  }
  // Space on a button presses the button.
  if (tag === "BUTTON" && found.deed === "press") return null;
  return found.deed;
}
