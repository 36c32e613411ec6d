/** Styles that are loaded with the code that needs them. */

/** Apply a style sheet to the page, behind those that it has. */
export function adopt(css: string): void {
  const sheet = new CSSStyleSheet();
  sheet.replaceSync(css);
  document.adoptedStyleSheets = [...document.adoptedStyleSheets, sheet];
}
