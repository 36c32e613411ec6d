"""What a token allows, as LiveKit shapes it: in one object of the claims, in one room.

Nothing is allowed that is not said. A name that is not known is an error, and not passed over: a
limit with a slip of the pen would be none.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field
from pydantic.alias_generators import to_camel

MAX_ROOM = 64  # characters of a name
ROOM_NAME = r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}"
_PATTERN = r"^(\*|[A-Za-z0-9][A-Za-z0-9._-]{0,63}\*?)$"


class Grants(BaseModel):
    """Grants of one token; on the wire `roomJoin` and so on.

    Args:
        room: Name of the room, or a prefix with a star behind it: `lab-*`.
        room_join: Come in at all.
        can_touch: Touch the object.
        can_view: Watch the scene.
        room_create: Make rooms.
        room_admin: Mute, remove and ban users, freeze and reset the object.
        room_record: Record what others do.
        can_inject_latency: Inject latency, where the server has it allowed.
        max_force: Most of this user's force that the body gets [N]; None for no limit.
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
        """Whether they are for a room of this name."""
        if self.room.endswith("*"):
            return room.startswith(self.room[:-1])
        return room == self.room


# Of everybody in a server that is open. That latency may be injected is the owner's option, and
# nobody administers a room without having shown who it is.
OPEN = Grants(room="*", room_join=True, can_touch=True, can_view=True, can_inject_latency=True)
