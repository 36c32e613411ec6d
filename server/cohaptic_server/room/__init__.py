"""Users and watchers of one body: one protocol state machine for each of them and for the room."""
