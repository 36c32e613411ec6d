"""Show a room in a cell of a notebook.

The widget is the client's (`cohaptic_client/notebook`), which an entry point names, since this
package imports no client.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import FunctionType
from typing import Any, Final, Protocol

from cohaptic.errors import SettingError
from cohaptic.extensions import load
from cohaptic.vec import Vec3

RATE: Final = 30.0  # changes of the traits in a second; as many as the page draws pictures
HEIGHT: Final = 480  # px


class ServesRoom(Protocol):
    """A room that this program serves, as [`serve`][cohaptic_server.serve] makes it."""

    @property
    def url(self) -> str:
        """Address for clients; empty while the room is not served."""
        ...

    def allow_frame(self, origin: str) -> None:
        """Let pages of an origin show the room's page in a frame."""
        ...


class RoomView(Protocol):
    """A room in a cell of a notebook; [`view`][cohaptic.view] makes it.

    `forces`, `tips`, `tick` and `status` are traits: `observe` calls a function whenever one of
    them changes. That happens in a thread of the view, also while a cell runs. A change of `tick`
    is told last, when all others are of the same tick. They are those of the newest scene; without
    a connection there are no forces and no tips.

    Attributes:
        forces: Force on the hand of each user, by name, shape (3,) [N].
        tips: Position of the tip of each user, by name, shape (3,) in the world frame [m].
        tick: Number of the server's tick that these are of.
        status: What the view does, or why it has ended, in a sentence.
    """

    forces: Mapping[str, Vec3]
    tips: Mapping[str, Vec3]
    tick: int
    status: str

    def observe(self, handler: Callable[[Any], None], names: str | list[str]) -> None:
        """Have a function called with a change (`change.new`) of these traits."""
        ...

    def unobserve(self, handler: Callable[[Any], None], names: str | list[str]) -> None:
        """Call the function no more."""
        ...

    def close(self) -> None:
        """Stop watching, end the thread and take the picture out of the notebook."""
        ...


def view(
    server: str | ServesRoom,
    *,
    token: str = "",
    page: str = "",
    rate: float = RATE,
    height: int = HEIGHT,
) -> RoomView:
    """Show a room in a cell of a notebook, and its forces as traits: `view = cohaptic.view(room)`.

    The cell shows the page of the server, in which one can also touch. A connection of the
    notebook's own fills the traits. Eight views may be open; one more closes the oldest.

    Args:
        server: Room that this program serves, the address of a server such as
            `ws://127.0.0.1:8765`, or the link of an invitation.
        token: Token of an invitation, if the link has none. It is not stored in the notebook.
        page: Address of the server's page as the browser reaches it, where that is not the
            address from here, such as `https://hub.example/user/ann/proxy/8765/`.
        rate: Largest number of changes of the traits, from 1 to 60 [1/s].
        height: Height of the picture, from 120 to 2000 [px].

    Raises:
        CohapticError: A value is outside its limits, no server answers, it refuses this view, or
            `anywidget` is missing: `pip install 'cohaptic[notebook]'`.
    """
    if not isinstance(server, str) and not server.url:
        limit = "served meanwhile, as in the block of `with room:` or after `room.__enter__()`"
        raise SettingError("room", "not served", limit)
    open_view = load("cohaptic.scripting", "view", FunctionType)
    opened: RoomView = open_view(server, token=token, page=page, rate=rate, height=height)
    return opened
