"""Pages that watch a room: one scene per tick, encoded once for all of them."""
