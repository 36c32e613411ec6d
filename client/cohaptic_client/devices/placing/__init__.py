"""Places the workspace of any device in the world, with scale, rotation, clutch and centring.

Terms:
    workspace: Map between the device's own frame and the world (`Workspace`).
    middle: Point of the device's frame in the middle of its workspace [m].
    origin, center: Point of the device's frame [m], and the point of the world on which it lies
        [m].
    scale: Metres of the world for a metre of the device.
    turn: Rotation of the device's frame about the vertical, counterclockwise from above [rad].
    place: Side of the body on which the middle lies: front, top or center.
    recentre: Option that puts the tip's first position on the workspace's centre.
    clutch: Button that keeps the tip still in the world while the hand moves the device.
"""
