"""Status of a running client, one line of JSON per report; `cohaptic demo` reads these lines."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field

from cohaptic.control.law import Law

# A device with at least this fraction of the object's stiffness counts as equally stiff: a
# difference of 1 % is far below the just noticeable difference of stiffness, about 10 % or more.
AS_STIFF = 0.99
# Laws whose hand feels the stiffness of the object if the device can render it.
_AS_STIFF_AS_OBJECT = [law.value for law in Law if not law.answers_own_dent]


class TouchStatus(BaseModel):
    """Status of one client at one time.

    Args:
        name: Name of the user.
        state: State in words: connecting, waiting, touching, free (no contact), fault (until the
            user acknowledges it), device silent, server silent, stopped.
        force: Force on the hand [N].
        felt_from_others: Part of the force that the other users' contacts cause [N].
        indentation: Indentation of the surface under the probe by this hand's force [m].
        k_o: Stiffness of the object at the contact [N/m].
        k_h: Gain of the law; with the predictive law it is below `k_o` if the device is softer than
            the object [N/m].
        max_stiffness: Largest stiffness that the device renders stably; 0 if not stated [N/m].
        along: Tangential force of friction; None without friction [N].
        lag: Time constant with which the object answers other users' forces (science 3.8) [s].
        round_trip: Mean time from a sample to the patch that answers it, without the time that the
            sample waits at the server [s].
        jitter: Mean deviation of the round trip [s].
        clock_offset: Server's wall clock less this machine's [s].
        clock_error: Bound on the error of `clock_offset`: half of the shortest recent round trip
            [s].
        law: Local model.
        loop_hz: Periods per second since the start.
        loop_late_p99: 99th percentile of the delay with which haptic periods start [s].
        loop_missed: Number of haptic periods that the loop skipped because it was too late.
        wavers: Time by which others are felt later than the link's least delay, so that its jitter
            is not felt (science 3.16) [s].
        level: Intended position of a simulated hand, from 0 (released) to 1 (pressed).
        wanted: Normal force that the law computes, before any limit [N].
        max_force: Limit of the force on this hand; 0 if unknown [N].
        fault: Why the safety layer keeps the force off; empty if the force is on.
        ledger: What acted on the force in the newest period, by the names of the rules, and of the
            stages of the server's tick behind `tick_` [N].
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
    wavers: float = 0.0
    level: float = 0.0
    wanted: float = 0.0
    max_force: float = 0.0
    fault: str = ""
    ledger: dict[str, float] = Field(default_factory=dict)

    @property
    def cut(self) -> bool:
        """Whether the hand touches, and its force limit cuts the force that the law computes."""
        return self.state == "touching" and 0.0 < self.max_force < AS_STIFF * self.wanted

    @property
    def soft(self) -> bool:
        """Whether the device is softer than the object, so that the hand feels the device alone."""
        stiff = self.law in _AS_STIFF_AS_OBJECT and self.max_stiffness > 0.0
        return stiff and self.max_stiffness < AS_STIFF * self.k_o
