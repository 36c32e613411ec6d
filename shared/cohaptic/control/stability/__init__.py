"""Stability of one contact, of several, and of a room of contacts with its delays.

Terms:
    C: Compliance matrix; C_ij is the displacement of contact i per force at contact j [m/N].
    K_i, K: Gain of hand i, the stiffness that its client renders, and the matrix of all [N/m].
    S: Coupling matrix K^(1/2) C K^(1/2) without each user's own block; dimensionless.
    coupling: Spectral radius m of S; hands do not couple at 0.
    loop delay: Time T_i from a force of user i to the surface that answers it, at the client [s].
    lag: Time constant tau of the filter through which all forces of a room enter the body [s].
    hand held still: Hand whose position does not change under any force.
    theta: Largest ratio of mass to damping of the hands in a room [s].
    lifted system: A law at the haptic rate, seen over one whole simulation period, eqs. (1)-(6).
    anticipated: A force that the server applies before a client has reported it (science 3.13).
"""
