"""Reads, writes and reloads files: keys, TLS certificates and the journal of a room.

Terms:
    key file: JWK set with the keys of `access/keys.py`, which only its owner may read.
    certificate: TLS certificate of the server and its private key, in two PEM files.
    record: One event that outlives the process of a room (`access/remembered.py`).
    journal: File with one record per line, one file for each room.
"""
