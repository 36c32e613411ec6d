"""A room in a cell of a notebook: the page of its server, and its forces as traits.

opening.py       what `cohaptic.view` calls: checks its arguments, and bounds the open views
room_widget.py   the widget, and what its front end asks
room_widget.js   the front end: the page in a frame, or why there is none
watched_room.py  a thread that watches the room, and comes back to a lost server
"""
