"""What `cohaptic.view` calls: checks its arguments, and bounds how many views are open."""

from __future__ import annotations

from collections import deque
from importlib.util import find_spec
from typing import TYPE_CHECKING, Final

from cohaptic.errors import SettingError
from cohaptic.notebook import HEIGHT, RATE, ServesRoom
from cohaptic_client.address import read_address
from cohaptic_client.settings import ClientSettings

if TYPE_CHECKING:
    from cohaptic_client.notebook.room_widget import RoomWidget

# A cell that runs again opens another view, and nobody closes the one before.
MOST: Final = 8
_open = deque["RoomWidget"]()


def open_view(
    server: str | ServesRoom,
    *,
    token: str = "",
    page: str = "",
    rate: float = RATE,
    height: int = HEIGHT,
) -> RoomWidget:
    """Open a view, and close the oldest where there are too many.

    Arguments and errors are those of [`view`][cohaptic.view].
    """
    if not 1.0 <= rate <= 60.0:
        raise SettingError("rate", f"{rate} 1/s", "from 1 to 60 1/s")
    if not 120 <= height <= 2000:
        raise SettingError("height", f"{height} px", "from 120 to 2000 px")
    if find_spec("anywidget") is None:
        limit = "installed: pip install 'cohaptic[notebook]'"
        raise SettingError("anywidget", "missing", limit)
    # Imported here, because it imports anywidget.
    from cohaptic_client.notebook.room_widget import RoomWidget, page_address

    address = read_address(server if isinstance(server, str) else server.url)
    if page:
        page = page_address(page)  # checked before anything is opened
    settings = ClientSettings(address.url, "view", token=address.token or token)
    room = None if isinstance(server, str) else server
    view = RoomWidget(settings, room, page=page, rate=rate, height=int(height))
    _open.append(view)
    while len(_open) > MOST:
        _open.popleft().close()
    return view
