"""Messages that change the name of a client while it touches or waits for a seat."""

from __future__ import annotations

from typing import Literal

from cohaptic.protocol.control.chosen_name import ChosenName
from cohaptic.protocol.control.message import ControlMessage, Name


class SetName(ControlMessage):
    """Ask for another name from now on, without leaving; the server answers with `named`.

    Args:
        name: As in a hello.
    """

    type: Literal["set_name"] = "set_name"
    name: ChosenName


class Named(ControlMessage):
    """The answer to `set_name`: the present name of the client.

    Args:
        name: Name that the client asked for; the previous name if that one is not available.
        reason: Why the name is not available, in one sentence; empty if the client got that name.
    """

    type: Literal["named"] = "named"
    name: Name
    reason: str = ""
