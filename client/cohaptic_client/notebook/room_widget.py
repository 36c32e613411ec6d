"""The widget: traits that a watching thread fills, and the answers to what its front end asks."""

# pyright: reportUnknownMemberType=false
from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Annotated, Final
from urllib.parse import urlencode, urlsplit, urlunsplit

import anywidget
import traitlets
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from cohaptic.errors import SettingError
from cohaptic.notebook import ServesRoom
from cohaptic.vec import norm
from cohaptic_client.notebook.watched_room import Seen, WatchedRoom
from cohaptic_client.settings import ClientSettings

_PAGES: Final = {"ws": "http", "wss": "https", "http": "http", "https": "https"}
Word = Annotated[str, Field(max_length=300)]


class _Asked(BaseModel):
    """Question of a front end.

    Args:
        origin: Origin of the page that has the notebook.
        request: Word that the answer repeats: of a view in two cells both front ends hear it.
    """

    model_config = ConfigDict(strict=True)

    origin: Word
    request: Word


class RoomWidget(anywidget.AnyWidget):
    """A room in a cell; see [`RoomView`][cohaptic.RoomView].

    The address of the page is no trait, because traits are stored in the notebook and the address
    may have a token. The front end asks for it.

    Args:
        settings: Settings with the address of the server and the token.
        room: Room of this program, which lets the notebook's page show it; None for another's.
        page: Address of the page as the browser reaches it; empty for that of the settings.
        rate: Largest number of changes of the traits [1/s].
        height: Height of the picture [px].

    Raises:
        CohapticError: No server answers, or it refuses.
    """

    _esm = Path(__file__).with_name("room_widget.js")

    forces = traitlets.Dict(read_only=True).tag(sync=True)
    tips = traitlets.Dict(read_only=True).tag(sync=True)
    tick = traitlets.Int(read_only=True).tag(sync=True)
    status = traitlets.Unicode("not connected", read_only=True).tag(sync=True)
    height = traitlets.Int().tag(sync=True)

    def __init__(
        self,
        settings: ClientSettings,
        room: ServesRoom | None,
        *,
        page: str,
        rate: float,
        height: int,
    ) -> None:
        self._room, self._page = room, page or settings.url
        self._watched = WatchedRoom(settings, rate, self._show, self._say)
        super().__init__(height=height)
        self.on_msg(self._answer)
        try:
            self._watched.open()
        except BaseException:
            super().close()
            raise

    def close(self) -> None:
        """Stop watching, end the thread and take the picture out of the notebook."""
        self._watched.close()
        super().close()

    def __repr__(self) -> str:
        """Return what the view does, and the forces."""
        forces = ", ".join(f"{name} {norm(force):.2f} N" for name, force in self.forces.items())
        return f"cohaptic.view: {self.status}" + (f"; {forces}" if forces else "")

    def _show(self, seen: Seen) -> None:
        with self.hold_sync():  # one message for all three
            self.set_trait("forces", seen.forces)
            self.set_trait("tips", seen.tips)
            self.set_trait("tick", seen.tick)

    def _say(self, sentence: str) -> None:
        self.set_trait("status", sentence)

    def _answer(self, widget: object, content: object, buffers: object) -> None:
        """Answer a front end, which wants the frame's address; what is no question is ignored."""
        try:
            asked = _Asked.model_validate(content)
        except ValidationError:
            return
        if self._room is not None:
            # Where no page may be shown, as in VS Code, the front end says so.
            with contextlib.suppress(SettingError):
                self._room.allow_frame(asked.origin)
        address = page_address(self._page, self._watched.token)
        self.send({"request": asked.request, "address": address})


def page_address(server: str, token: str = "") -> str:
    """Return the address of a server's page.

    Args:
        server: Address of the server or of its page.
        token: Token behind the `#`, which no browser sends to a server; empty for none.

    Raises:
        SettingError: It is no address of a page.
    """
    limit = "an address, such as ws://HOST:PORT or https://HOST/"
    try:
        parts = urlsplit(server)
    except ValueError:
        raise SettingError("address", repr(server[:100]), limit) from None
    scheme = _PAGES.get(parts.scheme)
    if scheme is None or not parts.netloc:
        raise SettingError("address", repr(server[:100]), limit)
    path = parts.path if parts.path.endswith("/") else f"{parts.path}/"
    fragment = urlencode({"token": token}) if token else ""
    return urlunsplit((scheme, parts.netloc, path, "view=people", fragment))
