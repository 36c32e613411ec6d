"""Messages on the wire; each message is checked when it is read.

Binary frames are laid out in one table (`layout.py`). The codecs here read it, and `make protocol`
writes the page's constants and the tables of docs/protocol.md from it. Control messages are JSON;
`messages.py` has those of a participant, `watch_messages.py` those of a page that watches.

Terms:
    frame: one binary message: a head with its kind, then its fields.
    patch: local model of the surface round one user's contact, sent to that user in every tick.
    neighbourhood: vertices round a contact with their displacement and compliance, in a mesh patch.
    scene: state of the whole object and of all hands, for pages that watch.
    traversal: order of the mesh's vertices in which neighbours differ little, for compression.
"""
