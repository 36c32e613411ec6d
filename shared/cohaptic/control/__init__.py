"""The local control laws, the choice of gains, and the friction model, as pure functions.

Terms:
    law: Local model of a client; maps the surface at the probe to the normal force on the hand.
    own force: Force on a user's hand whose opposite acts on the body at a tick, behind the lag [N].
    own dent: Displacement of the surface under a hand that the own force causes [m].
    free surface: A user's surface without that user's own dent; other users' dents stay in it.
    foot: Point of the surface whose normal line passes through the probe [m].
    sight: Free surface as evaluated at one probe: depth, normal, compliance, own force.
    gain: Stiffness K_h with which a law presses on the surface [N/m].
    loop delay: Time from a force to the surface that answers it, at one client [s].
    lag: Time constant tau with which the object answers forces in a room [s].
    anchor: Point of the resting surface that a contact with friction holds [m].
"""
