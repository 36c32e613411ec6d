"""`cohaptic demo`: a server and simulated users as processes, watched live and measured.

scene.py       who stands where and does what, and the truth of a press
places.py      where hands feel each other on any surface
set_up.py      the body, and hands on it
processes.py   starts and ends the processes (the only file here that does)
live_view.py   what each user feels now
browser.py     opens the page, where there is a browser that does not need this terminal
cli.py         the command

analysis.py    recordings side by side, and the parts of them that are measured
comparison.py  what each hand felt beside what it should have felt
drag.py        the same along the surface, of a hand that drags another's material
replay.py      what would have been felt without a network
lateness.py    how late a force is felt
rest.py        whether a force comes to rest, creeps or swings
result.py      all of it as a value, and as JSON
summary.py     the result for people
"""
