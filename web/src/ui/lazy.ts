/** Code that is loaded when it is first asked for. */

const AGAIN = 3000; // ms until code that did not come is asked for again; some panels ask ten times a second

/**
 * A function that loads code once; some seconds after a failure the code can be asked for again.
 *
 * @param done Called once, with the loaded code.
 * @param failed Called after each failure.
 */
export function lazily<T>(load: () => Promise<T>, done: (code: T) => void, failed: () => void = () => undefined): () => void {
  let asked = false;
  return () => {
    if (asked) return;
    asked = true;
    load().then(done, () => {
      setTimeout(() => { asked = false; }, AGAIN);
      failed();
    });
  };
}
