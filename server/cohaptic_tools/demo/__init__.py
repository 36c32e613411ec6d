"""`cohaptic demo`: a server and simulated users as processes, shown live and measured.

scene.py       positions and actions of the hands, and the reference equilibrium of a press
places.py      places on any surface at which hands feel each other
set_up.py      the body, and the hands on it
processes.py   starts and ends the processes (the only file here that does)
live_view.py   the live view of all users

analysis.py    recordings on one time grid, and the windows that are measured
comparison.py  the measured force on each hand beside its reference
lateness.py    the delay of a force
rest.py        whether a force rests, creeps or oscillates
result.py      the result as a value, and as JSON
summary.py     the result as a table on the terminal
"""
