"""Status of a running client, one line of JSON per report; `cohaptic demo` reads them."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict

from cohaptic.control.law import Law

# Share of the object's stiffness from which a device counts as no softer: a difference of 1 % is
# far below the just noticeable difference of stiffness, about 10 % or more.
AS_STIFF = 0.99
# Laws whose hand has the stiffness of the object, where its device renders that.
_AS_STIFF_AS_OBJECT = [law.value for law in Law if not law.answers_own_dent]


class TouchStatus(BaseModel):
    """Status of one client.

    Args:
        name: Name of the user.
        state: In words: connecting, waiting, touching, free, fault (until the user
            acknowledges it), device silent, server silent, stopped.
        force: On the hand [N].
        felt_from_others: Part of it that is there because others touch [N].
        indentation: Indentation of the surface under the probe [m].
        k_o: Stiffness of the body at the contact [N/m].
        k_h: Gain in use; below `k_o` with the predictive law where the device is the softer [N/m].
        max_stiffness: Largest that the device renders stably; 0 if it states none [N/m].
        along: Tangential force, by friction; None without friction [N].
        lag: Time constant with which the object answers the others' forces (science 3.8) [s].
        round_trip: Age of the own force in the newest patch, without its wait at the server [s].
        jitter: Mean deviation of the round trip [s].
        clock_offset: Server's wall clock less this machine's [s].
        clock_error: Bound on the error of that: half of the shortest round trip of late [s].
        law: Local model.
        loop_hz: Periods per second since the start.
        loop_late_p99: Lateness of a period, 99th percentile [s].
        loop_missed: Periods left out because the one before was too late.
        level: Intention of a simulated hand, from 0 (released) to 1 (pressed).
        wanted: Normal force that the law asks for, before any limit [N].
        max_force: Limit of this hand; 0 if unknown [N].
        fault: Why the safety layer keeps the force off; empty when it does not.
    """

    model_config = ConfigDict(frozen=True)

    name: str
    state: str
    force: float = 0.0
    felt_from_others: float = 0.0
    indentation: float = 0.0
    k_o: float = 0.0
    k_h: float = 0.0
    max_stiffness: float = 0.0
    along: float | None = None
    lag: float = 0.0
    round_trip: float = 0.0
    jitter: float = 0.0
    clock_offset: float = 0.0
    clock_error: float = 0.0
    law: str = ""
    loop_hz: float = 0.0
    loop_late_p99: float = 0.0
    loop_missed: int = 0
    level: float = 0.0
    wanted: float = 0.0
    max_force: float = 0.0
    fault: str = ""

    @property
    def cut(self) -> bool:
        """Whether the hand's limit cuts the force that it should feel."""
        return self.state == "touching" and 0.0 < self.max_force < AS_STIFF * self.wanted

    @property
    def soft(self) -> bool:
        """Whether the device cannot render the object's stiffness, and the hand feels its own."""
        stiff = self.law in _AS_STIFF_AS_OBJECT and self.max_stiffness > 0.0
        return stiff and self.max_stiffness < AS_STIFF * self.k_o
