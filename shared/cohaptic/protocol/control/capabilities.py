"""Capabilities of a device, as sent in a hello."""

from __future__ import annotations

from pydantic import Field

from cohaptic.protocol.control.message import ControlMessage, Name


class Capabilities(ControlMessage):
    """Capabilities of a device, in the spirit of the device metadata of IEEE 1918.1.1.

    Conformance with that standard is not claimed. A server only shows the capabilities to people;
    the values that the loop needs are fields of the hello itself.

    Args:
        device: Name of the kind of device.
        sensed_axes: Number of translational degrees of freedom that the device senses.
        force_axes: Number of axes along which the device gives force; 0 if it only senses.
        max_force: Largest force for a short time; 0 if the device only senses [N].
        max_stiffness: Largest stiffness that the device renders stably [N/m].
        damping: Physical damping of the device itself [N s/m].
        max_damping: Largest damping that the device renders stably; 0 if not measured [N s/m].
        resolution: Smallest step of position that the device resolves; 0 if unknown [m].
        rate: Highest rate at which the device reports positions and takes forces [Hz].
    """

    device: Name
    sensed_axes: int = Field(default=3, ge=0, le=3)
    force_axes: int = Field(default=3, ge=0, le=3)
    max_force: float = Field(default=0.0, ge=0.0, le=1000.0)
    max_stiffness: float = Field(default=0.0, ge=0.0, le=1e6)
    damping: float = Field(default=0.0, ge=0.0, le=1000.0)
    max_damping: float = Field(default=0.0, ge=0.0, le=1000.0)
    resolution: float = Field(default=0.0, ge=0.0, le=1.0)
    rate: float = Field(default=1000.0, gt=0.0, le=1e5)
