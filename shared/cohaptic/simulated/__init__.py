"""Simulated hands and links, for clients without a device and sessions without a network.

Terms:
    hand: Mass on a damper and a spring; the spring pulls the mass, the tip, to the intention.
    tip: Point of the hand that touches the object; its position is that of the probe [m].
    intention: Position over time to which the hand's spring pulls the tip [m].
    level: Fraction of the motion of an intention, from 0 (released) to 1 (pressed, or dragged out).
    place: Point of the resting surface that a hand presses, with the direction into the body.
    link: One direction of a simulated network connection.
"""
