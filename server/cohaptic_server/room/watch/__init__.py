"""Watchers of a room: pages that are shown the scene, which is encoded once for all of them.

Terms:
    scene: Message with the state of the body and of all users after one tick.
    record: Part of a scene with one user's probe, force and control gains.
    surface: Part of a scene with the displacement of all vertices [m].
    version: Number that increases when a scene differs visibly from the previous one.
    acknowledge: A page confirms that it has drawn the scene of a tick (message `Ack`).
    behind: A watcher is behind while it cannot be sent a new scene.
    sign of life: Unchanged scene that is sent so that the page knows of the connection.
"""
