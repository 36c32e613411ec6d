/** Code that is loaded when it is first asked for. */

/**
 * A function that loads code once; after a failure the code can be asked for again.
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
      asked = false;
      failed();
    });
  };
}
