"""The client of one user: a 1 kHz loop in its own process, a link to the server, a device.

This module stays light, because the process that runs the loop imports it: a public name is
imported from its module when it is first used.

Terms:
    tick: One step of the server's simulation; ticks are one simulation period apart [s].
    patch: Message of the server, one per tick, with the user's local surface and gains.
    welcome: Message by which the server admits this client to a room; it describes the body.
    tip, probe: End point of the device that touches the body, in the world frame [m].
    law: Local model that computes the normal force on the hand from the patch and the tip [N].
    loop: Haptic loop, which reads the device and writes a force in every haptic period.
    row: Record of one haptic period (`cohaptic.status.row.Row`).
    report: State of the loop as JSON, which the loop writes four times a second.
    fault: Event after which the safety layer takes the force off the hand, and its description.
    news: Sentence for the user about an event, such as a fault or a user who joins.
"""

from typing import TYPE_CHECKING

from cohaptic.lazy import lazy_names

if TYPE_CHECKING:
    from cohaptic_client.client import Client as Client
    from cohaptic_client.devices.device import Device as Device
    from cohaptic_client.devices.device import DeviceInfo as DeviceInfo
    from cohaptic_client.devices.device import DeviceSample as DeviceSample
    from cohaptic_client.devices.kind import DeviceChoice as DeviceChoice
    from cohaptic_client.devices.kind import DeviceConfig as DeviceConfig
    from cohaptic_client.devices.kind import DeviceKind as DeviceKind
    from cohaptic_client.devices.kind import Found as Found
    from cohaptic_client.devices.placing.options import PLACING_OPTIONS as PLACING_OPTIONS
    from cohaptic_client.devices.placing.options import place as place
    from cohaptic_client.devices.placing.options import placed_info as placed_info
    from cohaptic_client.devices.placing.placed import Placed as Placed
    from cohaptic_client.devices.simulated import SimulatedDevice as SimulatedDevice
    from cohaptic_client.loop.added import Contact as Contact
    from cohaptic_client.loop.added_rule import AddedRule as AddedRule
    from cohaptic_client.news import News as News
    from cohaptic_client.scripting.joining import join as join
    from cohaptic_client.scripting.joining import joined as joined
    from cohaptic_client.scripting.live_hand import LiveHand as LiveHand
    from cohaptic_client.scripting.live_hand import Other as Other
    from cohaptic_client.scripting.stream import Stream as Stream
    from cohaptic_client.settings import ClientSettings as ClientSettings

__all__ = [
    "PLACING_OPTIONS",
    "AddedRule",
    "Client",
    "ClientSettings",
    "Contact",
    "Device",
    "DeviceChoice",
    "DeviceConfig",
    "DeviceInfo",
    "DeviceKind",
    "DeviceSample",
    "Found",
    "LiveHand",
    "News",
    "Other",
    "Placed",
    "SimulatedDevice",
    "Stream",
    "join",
    "joined",
    "place",
    "placed_info",
]

# The module that defines each public name.
_HOMES = {
    "News": "cohaptic_client.news",
    "Stream": "cohaptic_client.scripting.stream",
    "Other": "cohaptic_client.scripting.live_hand",
    "LiveHand": "cohaptic_client.scripting.live_hand",
    "joined": "cohaptic_client.scripting.joining",
    "join": "cohaptic_client.scripting.joining",
    "Client": "cohaptic_client.client",
    "Device": "cohaptic_client.devices.device",
    "DeviceChoice": "cohaptic_client.devices.kind",
    "DeviceConfig": "cohaptic_client.devices.kind",
    "DeviceKind": "cohaptic_client.devices.kind",
    "Found": "cohaptic_client.devices.kind",
    "PLACING_OPTIONS": "cohaptic_client.devices.placing.options",
    "place": "cohaptic_client.devices.placing.options",
    "placed_info": "cohaptic_client.devices.placing.options",
    "Placed": "cohaptic_client.devices.placing.placed",
    "DeviceInfo": "cohaptic_client.devices.device",
    "DeviceSample": "cohaptic_client.devices.device",
    "SimulatedDevice": "cohaptic_client.devices.simulated",
    "ClientSettings": "cohaptic_client.settings",
    "Contact": "cohaptic_client.loop.added",
    "AddedRule": "cohaptic_client.loop.added_rule",
}

if not TYPE_CHECKING:  # otherwise a type checker would accept any name
    __getattr__, __dir__ = lazy_names(globals(), _HOMES)
