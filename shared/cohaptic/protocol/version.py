"""The version of the wire protocol, which is independent of the package's version."""

PROTOCOL_VERSION = 6
FAMILY = "cohaptic.v"  # beginning of the subprotocol's name in every version
SUBPROTOCOL = f"{FAMILY}{PROTOCOL_VERSION}"
