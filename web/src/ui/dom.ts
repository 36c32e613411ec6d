/** Makes elements without markup: text is inserted as text, style as classes. */

type Child = Node | string | null;

export interface Props {
  readonly class?: string;
  readonly id?: string;
  readonly text?: string;
  readonly title?: string;
  readonly attrs?: Readonly<Record<string, string>>;
  readonly on?: Readonly<Partial<Record<keyof HTMLElementEventMap, (event: Event) => void>>>;
}

export function el<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  props: Props = {},
  ...children: readonly Child[]
): HTMLElementTagNameMap[K] {
  const made = document.createElement(tag);
  if (props.class !== undefined) made.className = props.class;
  if (props.id !== undefined) made.id = props.id;
  if (props.text !== undefined) made.textContent = props.text;
  if (props.title !== undefined) made.title = props.title;
  for (const [name, value] of Object.entries(props.attrs ?? {})) made.setAttribute(name, value);
  for (const [name, listener] of Object.entries(props.on ?? {})) made.addEventListener(name, listener);
  made.append(...children.filter((child) => child !== null));
  return made;
}

/** Write text only if it differs; otherwise a live region would speak again, and the layout would be computed again. */
export function say(node: Element, text: string): void {
  if (node.textContent !== text) node.textContent = text;
}

/** Show or hide an element; the keyboard cannot reach a hidden element either. */
export function show(node: HTMLElement, visible: boolean): void {
  if (node.hidden === visible) node.hidden = !visible;
}

/** A quantity as books print it: an italic letter with its index. */
export function symbol(letter: string, index = ""): HTMLElement {
  const made = el("var", { text: letter });
  if (index !== "") made.append(el("sub", { text: index }));
  return made;
}

/** A button with a picture, a name for screen readers, and the key that does the same. */
export function iconButton(icon: SVGElement, name: string, key: string, press: () => void): HTMLButtonElement {
  const title = key === "" ? name : `${name} (${key})`;
  return el("button", { class: "icon-button", title, attrs: { type: "button", "aria-label": name }, on: { click: press } }, icon);
}

/** A choice of one of several: radio buttons that look like a switch. */
export interface Choice<T extends string> {
  readonly root: HTMLElement;
  /** Choose a value; null chooses none. */
  set(value: T | null): void;
  enable(value: T, enabled: boolean): void;
}

let groups = 0;

export function choice<T extends string>(
  label: string,
  options: readonly (readonly [T, string, string?])[],
  picked: (value: T) => void,
): Choice<T> {
  const name = `choice-${groups++}`;
  const inputs = new Map<T, HTMLInputElement>();
  const root = el("div", { class: "choice", attrs: { role: "radiogroup", "aria-label": label } });
  for (const [value, words, title] of options) {
    const input = el("input", { attrs: { type: "radio", name, value } });
    input.addEventListener("change", () => {
      if (input.checked) picked(value);
    });
    inputs.set(value, input);
    root.append(el("label", { class: "choice-option", ...(title === undefined ? {} : { title }) }, input, el("span", { text: words })));
  }
  return {
    root,
    set: (value) => {
      for (const [key, input] of inputs) input.checked = key === value;
    },
    enable: (value, enabled) => {
      const input = inputs.get(value);
      if (input !== undefined) input.disabled = !enabled;
    },
  };
}

/** A slider with its name and its value in words. */
export interface Slider {
  readonly root: HTMLElement;
  /** Value as it was set, even between two steps of the slider. */
  readonly value: number;
  /** Set the value, but not while a finger drags the slider or soon after a key: the value may be an echo of an earlier step. */
  set(value: number): void;
}

const ECHO = 1000; // ms; longer than an echo takes

export function slider(
  label: string,
  range: { readonly max: number; readonly step: number; readonly unit: string },
  moved: () => void,
): Slider {
  const input = el("input", { attrs: { type: "range", min: "0", max: `${range.max}`, step: `${range.step}`, "aria-label": label } });
  const value = el("output", { class: "slider-value" });
  const words = (): void => {
    say(value, `${input.value} ${range.unit}`);
    input.setAttribute("aria-valuetext", `${input.value} ${range.unit}`);
    input.style.setProperty("--share", `${(100 * Number(input.value)) / range.max}%`);
  };
  let chosen = 0;
  let timer = 0; // runs while echoes may come
  input.addEventListener("input", () => {
    clearTimeout(timer);
    timer = window.setTimeout(() => { timer = 0; }, ECHO);
    words();
    chosen = Number(input.value);
    moved();
  });
  words();
  return {
    root: el("label", { class: "slider" }, el("span", { class: "slider-name", text: label }), input, value),
    get value() { return chosen; },
    set: (next) => {
      if (timer !== 0 || (document.activeElement === input && input.matches(":active"))) return;
      chosen = next;
      input.value = `${next}`;
      words();
    },
  };
}
