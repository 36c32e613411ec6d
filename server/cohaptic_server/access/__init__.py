"""Access control: keys, signed tokens with grants, and single-use tokens. No I/O.

Terms:
    owner: Person who runs the server and holds its keys.
    token: Signed text (JWT) that states an identity, an end and grants.
    grants: Actions that a token allows in one room, or in all rooms with a common prefix.
    invitation: Token from the owner that begins a session; a single-use one does so only once.
    session: All connections of one client that began with one invitation; it has a name.
    session token: Token from the server with which a client comes back to its session.
    guest: Person who was admitted: an identity, grants and a session.
    key ring: The server's keys; each one verifies tokens, and the first one signs new tokens.
    removal: Record that an administrator put a user out of the room, for some time or for ever.
    pardon: Record that ends all earlier removals of users of one name.
"""
