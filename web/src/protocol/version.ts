/** The version of the protocol; `shared/cohaptic/protocol/version.py`. */

export const PROTOCOL_VERSION = 4;
export const SUBPROTOCOL = `cohaptic.v${PROTOCOL_VERSION}`;
