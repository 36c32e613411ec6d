"""Code shared by server and client: messages, control laws, clocks, errors.

This package imports neither the server nor the client. Its top level stays light, because the
process that runs the 1 kHz loop imports the package: `lazy_names` imports a public name from its
module when the name is first used.

Terms:
    room: One soft object on a server, with all users who touch it.
    hand: A user's contact with the object through a haptic device, real or simulated.
    probe: Tip of the device, as a position in the room [m].
    period: One cycle of a client's haptic loop, about 1 ms.
    tick: One step of the server's simulation, 5 to 100 ms.
    sample: Message of a client to the server with the state of one hand; it names the tick of the
        patch in use.
    patch: Message of the server to a client: the surface in front of one hand.
    visit: Time from a client's joining to its leaving.
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
    from cohaptic.kept import RoomRecording as RoomRecording
    from cohaptic.kept import record as record
    from cohaptic.notebook import RoomView as RoomView
    from cohaptic.notebook import view as view
    from cohaptic.protocol.messages import FixedGains as FixedGains
    from cohaptic.recording.archive import Recording as Recording
    from cohaptic.recording.archive import read_recording as read_recording
    from cohaptic.recording.recorder import Recorder as Recorder
    from cohaptic.sessions.export import export_session as export_session
    from cohaptic.sessions.tables import Session as Session
    from cohaptic.sessions.tables import read as read
    from cohaptic.sessions.tables import read_session as read_session
    from cohaptic.simulated.delay_line import LinkSettings as LinkSettings
    from cohaptic.simulated.hand import Hand as Hand
    from cohaptic.simulated.hand import HandScript as HandScript
    from cohaptic.simulated.hand import Intention as Intention
    from cohaptic.simulated.hand import Place as Place
    from cohaptic.simulated.hand import Rhythm as Rhythm
    from cohaptic.status.report import TouchStatus as TouchStatus
    from cohaptic.status.row import Row as Row
    from cohaptic.status.row import rows_in as rows_in

__all__ = [
    "BodyError",
    "Clock",
    "CloseCode",
    "CohapticError",
    "DeviceError",
    "FixedGains",
    "Hand",
    "HandScript",
    "Intention",
    "Law",
    "LinkSettings",
    "LocalProtocolError",
    "Place",
    "ProtocolError",
    "Recorder",
    "Recording",
    "RemoteProtocolError",
    "Rhythm",
    "RoomRecording",
    "RoomView",
    "Row",
    "ServerLost",
    "Session",
    "SettingError",
    "SystemClock",
    "TouchStatus",
    "__version__",
    "export_session",
    "read",
    "read_recording",
    "read_session",
    "record",
    "rows_in",
    "view",
]

# The module that defines each public name.
_HOMES = {
    "RoomRecording": "cohaptic.kept",
    "record": "cohaptic.kept",
    "read": "cohaptic.sessions.tables",
    "RoomView": "cohaptic.notebook",
    "view": "cohaptic.notebook",
    "rows_in": "cohaptic.status.row",
    "Row": "cohaptic.status.row",
    "Place": "cohaptic.simulated.hand",
    "Intention": "cohaptic.simulated.hand",
    "Clock": "cohaptic.clock",
    "SystemClock": "cohaptic.clock",
    "Law": "cohaptic.control.law",
    "FixedGains": "cohaptic.protocol.messages",
    "Recording": "cohaptic.recording.archive",
    "read_recording": "cohaptic.recording.archive",
    "Recorder": "cohaptic.recording.recorder",
    "export_session": "cohaptic.sessions.export",
    "Session": "cohaptic.sessions.tables",
    "read_session": "cohaptic.sessions.tables",
    "LinkSettings": "cohaptic.simulated.delay_line",
    "Hand": "cohaptic.simulated.hand",
    "HandScript": "cohaptic.simulated.hand",
    "Rhythm": "cohaptic.simulated.hand",
    "TouchStatus": "cohaptic.status.report",
}

if not TYPE_CHECKING:  # otherwise a type checker would accept any name
    __getattr__, __dir__ = lazy_names(globals(), _HOMES)
