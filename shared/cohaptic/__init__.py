"""Code shared by server and client: messages, control laws, clocks, errors.

This package imports neither the server nor the client. Its top level stays light, because the
process that runs the 1 kHz loop imports the package: a public name is imported from its module when
it is first used.
"""

from typing import TYPE_CHECKING

from cohaptic.errors import BodyError as BodyError
from cohaptic.errors import CloseCode as CloseCode
from cohaptic.errors import CohapticError as CohapticError
from cohaptic.errors import DeviceError as DeviceError
from cohaptic.errors import LocalProtocolError as LocalProtocolError
from cohaptic.errors import ProtocolError as ProtocolError
from cohaptic.errors import RemoteProtocolError as RemoteProtocolError
from cohaptic.errors import ServerLost as ServerLost
from cohaptic.errors import SettingError as SettingError
from cohaptic.lazy import lazy_names

__version__ = "0.1.0"

if TYPE_CHECKING:
    from cohaptic.clock import Clock as Clock
    from cohaptic.clock import SystemClock as SystemClock
    from cohaptic.control.law import Law as Law
    from cohaptic.protocol.messages import FixedGains as FixedGains
    from cohaptic.simulated.delay_line import LinkSettings as LinkSettings
    from cohaptic.simulated.hand import Hand as Hand
    from cohaptic.simulated.hand import HandScript as HandScript
    from cohaptic.simulated.hand import Rhythm as Rhythm
    from cohaptic.status.report import TouchStatus as TouchStatus

__all__ = [
    "BodyError",
    "Clock",
    "CloseCode",
    "CohapticError",
    "DeviceError",
    "FixedGains",
    "Hand",
    "HandScript",
    "Law",
    "LinkSettings",
    "LocalProtocolError",
    "ProtocolError",
    "RemoteProtocolError",
    "Rhythm",
    "ServerLost",
    "SettingError",
    "SystemClock",
    "TouchStatus",
    "__version__",
]

# The module that defines each public name.
_HOMES = {
    "Clock": "cohaptic.clock",
    "SystemClock": "cohaptic.clock",
    "Law": "cohaptic.control.law",
    "FixedGains": "cohaptic.protocol.messages",
    "LinkSettings": "cohaptic.simulated.delay_line",
    "Hand": "cohaptic.simulated.hand",
    "HandScript": "cohaptic.simulated.hand",
    "Rhythm": "cohaptic.simulated.hand",
    "TouchStatus": "cohaptic.status.report",
}

if not TYPE_CHECKING:  # otherwise a type checker would accept any name
    __getattr__, __dir__ = lazy_names(globals(), _HOMES)
