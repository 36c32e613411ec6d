"""Actions of an administrator in a room, in the words of the command line."""

from __future__ import annotations

from enum import Enum


class Action(Enum):
    """Action of an administrator in a room; the value is its word on the command line."""

    LIST = "list"
    MUTE = "mute"
    UNMUTE = "unmute"
    KICK = "kick"
    BAN = "ban"
    UNBAN = "unban"
    FREEZE = "freeze"
    UNFREEZE = "unfreeze"
    RESET = "reset"
    BUDGET = "force-budget"
    RECORD = "record"
    END_RECORDING = "end-recording"


TO_SOMEBODY = (Action.MUTE, Action.UNMUTE, Action.KICK, Action.BAN, Action.UNBAN)
