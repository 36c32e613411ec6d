"""Messages about who else is here: how many watch, whose view is followed, who points at what.

Only over a connection that watches, and only where its `watch` asked for `company`.

client -> server    present, follow, aim, point
server -> client    company, aimed, pointed, declined
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from cohaptic.protocol.control.chosen_name import ChosenName
from cohaptic.protocol.control.message import ControlMessage, Name, WithSecrets
from cohaptic.protocol.frame import MAX_POSITION

MAX_TURN = 7.0  # rad; a whole turn either way, and room for rounding
MAX_ELEVATION = 1.6  # rad; straight down or up
MIN_DISTANCE, MAX_DISTANCE = 1.0, 50.0  # radii of the body, from its middle to the eye
MOST_FOLLOWERS = 32  # of one view; each costs a message ten times a second
MOST_OPEN = 64  # users of the fullest room

User = Annotated[int, Field(ge=1, lt=2**32)]
Coordinate = Annotated[float, Field(ge=-MAX_POSITION, le=MAX_POSITION)]  # [m]
Turn = Annotated[float, Field(ge=-MAX_TURN, le=MAX_TURN)]  # [rad]
Elevation = Annotated[float, Field(ge=-MAX_ELEVATION, le=MAX_ELEVATION)]  # [rad]
Distance = Annotated[float, Field(ge=MIN_DISTANCE, le=MAX_DISTANCE)]  # radii of the body


class Present(WithSecrets):
    """Who sits at a page: at first, and at each change.

    Args:
        name: By which others know the visitor.
        user: Number of its hand; None while it only watches. It counts only with the key.
        key: Key of the hello of that hand: nobody else can say that it is theirs. Not on the wire
            without a hand.
        open: Whether others may follow its view.
    """

    type: Literal["present"] = "present"
    name: ChosenName
    user: User | None = None
    key: Annotated[str, Field(min_length=16, max_length=64, pattern=r"^[!-~]+$")] | None = Field(
        default=None, repr=False
    )
    open: bool = False


class Follow(ControlMessage):
    """See what a user sees from now on; None ends that."""

    type: Literal["follow"] = "follow"
    user: User | None


class Aim(ControlMessage):
    """From where the page of a user looks: state, and only while somebody follows.

    Args:
        azimuth: Round the vertical, 0 from +x [rad].
        elevation: Above the horizon [rad].
        distance: From the middle of the body, in its radii.
    """

    type: Literal["aim"] = "aim"
    azimuth: Turn
    elevation: Elevation
    distance: Distance


class Point(ControlMessage):
    """Point at a place for everybody to see, for a few seconds.

    Args:
        point: Point of the resting surface, world frame [m].
    """

    type: Literal["point"] = "point"
    point: tuple[Coordinate, Coordinate, Coordinate]


class Follower(ControlMessage):
    """One who follows.

    Args:
        user: Its number; None for one who only watches.
        name: Name of it.
    """

    user: User | None
    name: Name


class Company(ControlMessage):
    """Who else is here, as far as it concerns this page: state, at first and at each change.

    Args:
        watching: How many watch and have no hand here, this page with them.
        open: Users whose view may be followed at present.
        following: The user whose view this page is sent; None for nobody's.
        followers: Who is sent the view of this page.
        may_point: Whether this page may point at the surface.
    """

    type: Literal["company"] = "company"
    watching: int = Field(ge=0)
    open: Annotated[tuple[User, ...], Field(max_length=MOST_OPEN)] = ()
    following: User | None = None
    followers: Annotated[tuple[Follower, ...], Field(max_length=MOST_FOLLOWERS)] = ()
    may_point: bool = True


class Aimed(ControlMessage):
    """The view of the user whom this page follows; fields as in `Aim`."""

    type: Literal["aimed"] = "aimed"
    user: User
    azimuth: Turn
    elevation: Elevation
    distance: Distance


class Pointed(ControlMessage):
    """Somebody points at the surface.

    Args:
        user: Who; None for one who only watches.
        name: Name of it.
        point: Point of the resting surface, world frame [m].
    """

    type: Literal["pointed"] = "pointed"
    user: User | None
    name: Name
    point: tuple[Coordinate, Coordinate, Coordinate]


class Declined(ControlMessage):
    """Why a wish was not carried out, or what was carried out has ended.

    Args:
        what: `follow` or `point`.
        reason: One sentence.
    """

    type: Literal["declined"] = "declined"
    what: Literal["follow", "point"]
    reason: Annotated[str, Field(max_length=400)]


CompanyRequest = Present | Follow | Aim | Point
CompanyNews = Company | Aimed | Pointed | Declined
