"""One tick of the shared object, as pure functions: find contacts, apply forces, build patches.

Terms:
    participant: A user, with what its client and its device are (`state.Participant`).
    touch: Newest sample of a participant: what its hand does (`state.Touch`).
    row: Index of a user in the arrays of one tick; -1 for a user who was not in that tick.
    frame: Foot [m], contact point [m] and outward unit normal of a contact, shape (3, 3).
    free surface: Surface of the body under all loads except those of the user concerned [m].
    load: Force along one axis of a contact [N]: the normal, and with friction also two tangents.
    span: Range of one user's loads among the loads of all users.
    presence: Share of a user's force that counts, 0 to 1; it rises and falls slowly.
    nearness: Weight of a user as a neighbour: 1 in contact, 0 for a probe out of reach.
    pressing: Whether the body carries a force of a user, who is then in the room's loop.
    window: Vertices round one contact at which a tick evaluates the free surface.
    frictional: Rows of the users with friction, whose forces may have tangential parts.
"""
