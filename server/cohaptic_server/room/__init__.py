"""Users and watchers of one body: protocol state machines for the room and for each connection.

Terms:
    peer: Client at the other end of one connection; a user, a watcher, or not accepted yet.
    user: Client that touches the body with a probe; users have numbers, which are never reused.
    watcher: Client that is shown the scene, such as a web page; it has no user number.
    touch: Newest contact sample of a user, together with the settings of that user.
    patch: Message to one user with a local model of the surface and its control gains.
    tick: One step of the simulation, once per simulation period [s].
    seat: Right to be one of the users, or watchers, that the room admits at the same time.
    source: Network address against whose rate limits a connection counts.
    outcome: Tasks that a state machine gives to the shell, such as messages to write.
    clear: Whether the operating system has taken all earlier writes to a connection.
"""
