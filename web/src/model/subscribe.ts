/** Calls a listener at every change; the returned function ends the subscription. */
export type Subscribe = (listener: () => void) => () => void;
