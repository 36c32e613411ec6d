"""The version of the wire, apart from the version of the package."""

PROTOCOL_VERSION = 4
FAMILY = "cohaptic.v"  # of subprotocols, whatever the version
SUBPROTOCOL = f"{FAMILY}{PROTOCOL_VERSION}"
