"""Pages that watch a room; the scene of a tick is encoded once for all of them."""
