"""Messages about the name by which a client goes, while it touches or waits for a seat."""

from __future__ import annotations

from typing import Literal

from cohaptic.protocol.control.chosen_name import ChosenName
from cohaptic.protocol.control.message import ControlMessage, Name


class SetName(ControlMessage):
    """Go by another name from now on, without leaving; answered by `named`.

    Args:
        name: As in a hello.
    """

    type: Literal["set_name"] = "set_name"
    name: ChosenName


class Named(ControlMessage):
    """The answer to `set_name`: the name by which the client goes now.

    Args:
        name: That it asked for; the one of before where that could not be had.
        reason: Why it could not, one sentence; empty where it could.
    """

    type: Literal["named"] = "named"
    name: Name
    reason: str = ""
