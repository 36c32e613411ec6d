"""Who is in a room: one protocol state machine per client, and what waits for each."""
