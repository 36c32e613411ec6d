"""Time constants of a room: the lag of its forces, and the lag with which contacts turn.

Terms:
    lag: Time constant tau of the low-pass through which the room's forces reach the body [s].
    S: Coupling matrix K^(1/2) C K^(1/2) of hand stiffness and compliance, no diagonal (3.8).
    answer: Change of force with which a hand reacts to a displacement by other users [N].
    anticipation: Prediction of the hands' answers, made in the tick that causes them (3.13).
    law of the paper: Control law that also answers the dent that its own force makes.
    turning: Rotation of a contact's normal when other users tilt the surface under the probe.
    steep contact: Contact whose normal turns too fast to be neglected (slope below `GENTLE`).
    tangents: The two directions along the surface at a steep contact.
    late: Delay of the answers of turned contacts, the product T_b q of 3.13 (d) [s].
    held: Gain of hands that hold still (`Gains.held`), in contrast to hands that move.
"""
