"""The version of the wire, apart from the version of the package."""

PROTOCOL_VERSION = 2
SUBPROTOCOL = f"cohaptic.v{PROTOCOL_VERSION}"
