"""The users and watchers of one body: a protocol state machine for each, and for the room."""
