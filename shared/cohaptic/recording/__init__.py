"""A recording of a client's haptic periods: written while it is made, and read back.

journal.py    the blocks of a recording in progress, as bytes
part.py       the file NAME.npz.part with these blocks, which one process owns
outline.py    what a journal holds, found in one pass: seconds, gaps, clocks
archive.py    turns a journal into a .npz, and reads both
recorder.py   takes the rows of a client, and writes them in a thread

Terms:
    recording: All rows of one client from its first haptic period to its last.
    part: File of a recording in progress, or of one whose process was killed.
    gap: Stretch of time in a recording without rows.
"""
