"""`cohaptic demo`: a server and simulated users as processes, shown live and measured.

scene.py          defines where the hands are and what they do, and their equilibrium in a press
places.py         finds places on any surface at which hands feel each other
felt.py           defines when hands feel each other, and predicts it
settled.py        chooses places and a depth at which the hands come to rest
capacity.py       predicts how many hands the machine bears, and at which rate
set_up.py         builds the body and places the hands on it
processes.py      starts and ends the server and the clients
live_view.py      shows all users live
demonstration.py  performs a demonstration with these parts

analysis.py       puts recordings on one time grid, and finds the windows to measure
comparison.py     compares the measured force on each hand with its reference
lateness.py       measures the delay of a force
punctuality.py    tells whether patches and haptic periods came on time
rest.py           judges whether a force rests, creeps or oscillates
result.py         evaluates the recordings; the result is a value, and JSON
summary.py        shows the result as a table on the terminal

Terms:
    hand: Simulated user; the first hand presses or drags in a rhythm, the others rest.
    place: Point of the resting surface where a hand stands, with the direction inwards.
    placement: Places of all hands, and the depth to which the first hand presses [m].
    level: Intended position of a hand, from 0 (off, or not dragged) to 1 (pressed, or dragged).
    stretch: Interval of grid indices in which no hand intends to move.
    window: Interval of grid indices around one press or drag.
    felt: Part of the force on a hand that is due to the other hands [N].
    reference: Force in the equilibrium of body and hands, without a network [N].
    engaged: A user is engaged while its status is `touching` or `free` (in contact or not).
    rest: Verdict on a force: it rests, approaches its value slowly, or is unstable.
"""
