"""The client's side of the connection: protocol, pacing, timing, delay lines."""
