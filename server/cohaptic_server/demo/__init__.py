"""`cohaptic demo`: a server and simulated users as processes, watched live and measured.

scene.py      who stands where and does what, and the truth of it
processes.py  starts and ends the processes (the only file here that does)
analysis.py   recordings against the truth: forces, delays, stability
summary.py    the result for people and for programs
browser.py    opens the page, where there is a browser that does not need this terminal
cli.py        the command
"""
