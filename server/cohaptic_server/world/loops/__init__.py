"""Loops of a tick over all users of a room, compiled where a compiler is at hand.

Each loop gets flat arrays with the data of all users, and writes into arrays of the caller.

Terms:
    before: Row of each user in the last tick; -1 for a user who was not there.
    first: Row at which a loop begins, after the caller has served the row before in Python.
    starts: Where the part of each user begins in a flat array, and where the last part ends.
    known: Vertices at which the displacement of a user's surface is stored, user after user.
    under: Vertices under the pressure of each contact, user after user.
    frames: Foot [m], contact point [m] and outward unit normal of each contact, (n, 3, 3).
    places: Contact points on displaced surfaces, shape (n, 3) [m].
    found: Array or buffer that receives the result of a loop or of a search.
    fitted, touched, carried: Parts of a window (`patch_geometry.Windows`).
"""
