/** Says that something has changed; the answer ends the subscription. */
export type Subscribe = (listener: () => void) => () => void;
