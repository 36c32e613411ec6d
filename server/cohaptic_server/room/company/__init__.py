"""People in a room: who is there, whose view others follow, and who points. No I/O.

Terms:
    company: The people in a room, as its pages are told.
    page: Web page of a person, which is a watcher; it is told the company if it asks for that.
    hand: The user (by number) whose probe the person of a page moves.
    aim: Viewpoint of a page's camera: azimuth, elevation and distance.
    follow: To take over the aim of a user's page continuously.
    open: A page is open if its owner lets other pages follow its aim.
    point: To mark a point of the body for all pages.
"""
