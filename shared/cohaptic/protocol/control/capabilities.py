"""What a device gives, as a hello tells it."""

from __future__ import annotations

from pydantic import Field

from cohaptic.protocol.control.message import ControlMessage, Name


class Capabilities(ControlMessage):
    """What a device gives, in the spirit of the device metadata of IEEE 1918.1.1.

    Conformance with that standard is not claimed. A server shows them, and takes them for nothing
    else: what the loop needs is in the hello itself.

    Args:
        device: Name of its kind.
        sensed_axes: Degrees of freedom of translation that it senses.
        force_axes: Along which it gives force; 0 for one that only senses.
        max_force: For a short time; 0 for one that only senses [N].
        max_stiffness: That it renders stably [N/m].
        damping: Damping of its own, physical [N s/m].
        max_damping: That it renders stably; 0 where nobody has measured it [N s/m].
        resolution: Least step of position that it tells apart; 0 where unknown [m].
        rate: At which it reports and takes forces at best [Hz].
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
