"""Whole sessions on record, all people of a room in one MCAP file: written, read, and exported.

entries.py     what a session consists of: the room's inputs, its outputs, rows of the clients
wire.py        the encoding of protobuf, as far as the file needs it
schemas.py     which channel an entry has in the file, and how its fields are described there
codec.py       entries as messages, and back
plots.py       what Foxglove draws, made of the entries while they are written
writer.py      the file of a session in progress, which one process owns
recorder.py    takes entries from a server without holding it up, and writes them in a thread
container.py   chunks of an MCAP file, of a stranger or of a killed process too
reader.py      the entries of a file in the order of their times, and what is in it at a glance
replay.py      a file as a replay shows it: an overview, scenes by stretches, and why a force was
tables.py      a session as pandas tables on one clock
export.py      the tables as Parquet, CSV or HDF5
bids.py        a session as a data set of BIDS Motion

Terms:
    entry: One thing that happened, or was measured, with its time on the server's clock.
    chunk: Part of the file that is compressed at once, about one second of a session.
    row: Record of one haptic period of one client, as in `cohaptic.status.row`.
"""
