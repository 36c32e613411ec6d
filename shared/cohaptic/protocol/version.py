"""The version of the wire, which is independent of the version of the package."""

PROTOCOL_VERSION = 4
FAMILY = "cohaptic.v"  # beginning of the subprotocol's name in every version
SUBPROTOCOL = f"{FAMILY}{PROTOCOL_VERSION}"
