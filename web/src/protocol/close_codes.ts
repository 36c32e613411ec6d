/** Close codes of the protocol, `cohaptic.errors.CloseCode` in TypeScript (docs/protocol.md), and two of RFC 6455. */

/** The page is done with the connection. */
export const NORMAL = 1000;
/** Set by the browser alone: the connection broke, or was never made. */
export const ABNORMAL = 1006;

/** A message broke the protocol. */
export const BAD_MESSAGE = 4400;
/** No token where one is needed, or one that is not valid. */
export const UNAUTHENTICATED = 4401;
/** The token is not for this room, or not for what was asked. */
export const FORBIDDEN = 4403;
/** The address names no room of this server. */
export const NO_ROOM = 4404;
/** The name is in use in this room. */
export const NAME_TAKEN = 4409;
/** The server has another object from now on. */
export const OBJECT_CHANGED = 4410;
/** The server speaks another version of the protocol. */
export const WRONG_VERSION = 4426;
/** No place is left, to touch or to watch. */
export const ROOM_FULL = 4429;
/** Too many messages waited for this client. */
export const TOO_SLOW = 4430;
/** This page sent or asked for more than its budget. */
export const TOO_MANY = 4431;
/** The server stops, and may come back. */
export const SERVER_STOPS = 4503;
