"""The wire: what client and server say to each other. `docs/protocol.md` is its description."""
