"""Watching: what pages get of the world without touching it.

records.py        from the world to what the wire carries; the only file here that knows the world
scene_encoder.py  one tick's scene, encoded once for everybody who wants it the same way
watcher.py        one connection that watches, as a state machine
gallery.py        everybody who watches
latency.py        delay injected between a user and the server
green.py          Green's functions of a body, and the name that they have everywhere
green_blocks.py   the same, solved beside the tick and kept
page.py, http.py  the page's files; from request to response
origins.py        whose pages may open a websocket
"""
