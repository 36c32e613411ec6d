"""Messages about other visitors: how many watch, whose view is followed, who points at what.

These messages are sent only over a connection that watches and whose `watch` asked for `company`.

client -> server    present, follow, aim, point
server -> client    company, aimed, pointed, declined
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from cohaptic.protocol.control.message import ChosenName, ControlMessage, Name, WithSecrets
from cohaptic.protocol.frame import MAX_POSITION

MAX_TURN = 7.0  # rad; a whole turn either way, with room for rounding
MAX_ELEVATION = 1.6  # rad; straight down or up
MIN_DISTANCE, MAX_DISTANCE = 1.0, 50.0  # radii of the body, from its middle to the eye
MAX_FOLLOWERS = 32  # of one view; each follower costs a message ten times a second
MAX_OPEN = 64  # users of the fullest room

User = Annotated[int, Field(ge=1, lt=2**32)]
Coordinate = Annotated[float, Field(ge=-MAX_POSITION, le=MAX_POSITION)]  # [m]
Turn = Annotated[float, Field(ge=-MAX_TURN, le=MAX_TURN)]  # [rad]
Elevation = Annotated[float, Field(ge=-MAX_ELEVATION, le=MAX_ELEVATION)]  # [rad]
Distance = Annotated[float, Field(ge=MIN_DISTANCE, le=MAX_DISTANCE)]  # radii of the body


class Present(WithSecrets):
    """Tell the server the name and the hand of a page's visitor; sent first and at each change.

    Args:
        name: Name that other visitors see.
        user: User number of the visitor's hand; None while the visitor only watches. The server
            ignores the number without the right key.
        key: Key from the hello of that hand, which proves that the hand is the visitor's. Not on
            the wire without a hand.
        open: Whether others may follow the visitor's view.
    """

    type: Literal["present"] = "present"
    name: ChosenName
    user: User | None = None
    key: Annotated[str, Field(min_length=16, max_length=64, pattern=r"^[!-~]+$")] | None = Field(
        default=None, repr=False
    )
    open: bool = False


class Follow(ControlMessage):
    """Follow the view of a user from now on; None ends following."""

    type: Literal["follow"] = "follow"
    user: User | None


class Aim(ControlMessage):
    """Present viewpoint of a user's page; sent only while another page follows the view.

    Args:
        azimuth: Angle round the vertical, 0 from +x [rad].
        elevation: Angle above the horizon [rad].
        distance: Distance from the middle of the body [radii of the body].
    """

    type: Literal["aim"] = "aim"
    azimuth: Turn
    elevation: Elevation
    distance: Distance


class Point(ControlMessage):
    """Point at a place that all visitors then see marked for a few seconds.

    Args:
        point: Point of the resting surface in the world frame [m].
    """

    type: Literal["point"] = "point"
    point: tuple[Coordinate, Coordinate, Coordinate]


class Follower(ControlMessage):
    """A visitor who follows a view.

    Args:
        user: User number of the follower; None for a visitor who only watches.
    """

    user: User | None
    name: Name


class Company(ControlMessage):
    """State of the other visitors that this page needs; sent first and at each change.

    Args:
        watching: Number of visitors who watch without a hand in the room, including this page.
        open: Users whose view may be followed at present.
        following: User whose view this page receives; None if it follows no view.
        followers: Visitors who receive the view of this page.
        may_point: Whether this page may point at the surface.
    """

    type: Literal["company"] = "company"
    watching: int = Field(ge=0)
    open: Annotated[tuple[User, ...], Field(max_length=MAX_OPEN)] = ()
    following: User | None = None
    followers: Annotated[tuple[Follower, ...], Field(max_length=MAX_FOLLOWERS)] = ()
    may_point: bool = True


class Aimed(ControlMessage):
    """The view of the user whom this page follows; fields as in `Aim`."""

    type: Literal["aimed"] = "aimed"
    user: User
    azimuth: Turn
    elevation: Elevation
    distance: Distance


class Pointed(ControlMessage):
    """A visitor points at the surface.

    Args:
        user: User number of the visitor; None for a visitor who only watches.
        name: Name of the visitor.
        point: Point of the resting surface in the world frame [m].
    """

    type: Literal["pointed"] = "pointed"
    user: User | None
    name: Name
    point: tuple[Coordinate, Coordinate, Coordinate]


class Declined(ControlMessage):
    """A request was not carried out, or its effect has ended.

    Args:
        what: Kind of the request, `follow` or `point`.
        reason: Reason in one sentence.
    """

    type: Literal["declined"] = "declined"
    what: Literal["follow", "point"]
    reason: Annotated[str, Field(max_length=400)]


CompanyRequest = Present | Follow | Aim | Point
CompanyNews = Company | Aimed | Pointed | Declined
