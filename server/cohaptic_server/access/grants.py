"""Grants of a token for one room, as one object among its claims (the form that LiveKit uses).

A token allows only the actions that it states. An unknown name is an error and is not ignored,
since otherwise a misspelt limit would have no effect.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field
from pydantic.alias_generators import to_camel

MAX_ROOM = 64  # characters of a name
ROOM_NAME = r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}"
_PATTERN = r"^(\*|[A-Za-z0-9][A-Za-z0-9._-]{0,63}\*?)$"


class Grants(BaseModel):
    """Grants of one token; in the token the names are in camel case, such as `roomJoin`.

    Args:
        room: Name of the room, or a prefix and a star for all rooms that begin so: `lab-*`.
        room_join: Right to come in at all.
        can_touch: Right to touch the object.
        can_view: Right to watch the scene.
        room_create: Right to make rooms.
        room_admin: Right to mute, remove and ban users, and to freeze and reset the object.
        room_record: Right to record what others do.
        can_inject_latency: Right to inject latency, if the server allows it.
        max_force: Limit on this user's force on the body [N]; None for no limit.
    """

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        strict=True,
        allow_inf_nan=False,
        alias_generator=to_camel,
        populate_by_name=True,
    )

    room: Annotated[str, Field(pattern=_PATTERN, max_length=MAX_ROOM + 1)]
    room_join: bool = False
    can_touch: bool = False
    can_view: bool = False
    room_create: bool = False
    room_admin: bool = False
    room_record: bool = False
    can_inject_latency: bool = False
    max_force: Annotated[float, Field(ge=0.0, le=100.0)] | None = None

    def hold_in(self, room: str) -> bool:
        """Whether the grants are for a room of this name."""
        if self.room.endswith("*"):
            return room.startswith(self.room[:-1])
        return room == self.room


# Grants of everybody on an open server. The owner's option decides whether latency may be injected,
# and nobody administers a room without a proven identity.
OPEN = Grants(room="*", room_join=True, can_touch=True, can_view=True, can_inject_latency=True)
