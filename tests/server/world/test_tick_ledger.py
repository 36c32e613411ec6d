"""What a tick says of the force of each user: which stage cut it, and by how much."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from cohaptic.control.tick_ledger import TickLedger
from cohaptic.protocol.patch import Patch
from cohaptic.vec import dot
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.world.applied_forces import RELEASE_TIME
from cohaptic_server.world.stages.chain import CHAIN
from cohaptic_server.world.users import WorldState
from tests.server.touches import side, touch
from tests.server.world.rooms import TICKS, hands, mixed_room
from tests.server.world.worlds import DT, RISE, play

BESIDE = 0.3  # rad from one hand to the next, who then share most of their compliance


def test_the_entries_and_the_force_of_the_sample_are_the_force_that_the_body_carries(
    small_balloon: Balloon,
) -> None:
    seen = np.zeros(5)
    for tick, (state, patches) in enumerate(mixed_room(small_balloon, TICKS)):
        samples = {of.user: of for of in hands(tick)}
        for user, patch in patches.items():
            normal = patch.normal
            asked = min(samples[user].who.max_force, max(0.0, dot(samples[user].force, normal)))
            carried = dot(patch.own_force, normal)
            assert asked + sum(patch.ledger.entries) == pytest.approx(carried, abs=1e-9)
            assert carried == pytest.approx(state.users[user].force, abs=1e-9)
            seen = np.maximum(seen, np.abs(patch.ledger.entries))
    assert seen[0] > 0.1  # who comes, and who jumps


def test_every_entry_is_of_a_stage() -> None:
    names = [stage.name for stage in CHAIN]
    entries = [name.removeprefix("by_") for name in vars(TickLedger()) if name.startswith("by_")]
    found = [name.replace("anticipate", "anticipation") for name in names]
    assert [name for name in found if name in entries] == entries


def test_a_hand_alone_that_holds_still_is_cut_by_nothing(small_balloon: Balloon) -> None:
    _, patches = play(small_balloon, [touch(force=2.0)])
    assert patches[1].ledger.entries == pytest.approx((0.0,) * 5, abs=1e-12)


def test_one_who_comes(small_balloon: Balloon) -> None:
    _, patches = play(small_balloon, [touch(force=2.0)], 1)
    left_out = 2.0 * (1.0 - DT / RELEASE_TIME)
    assert patches[1].ledger.by_presence == pytest.approx(-left_out)


def test_one_who_would_press_through_the_body(small_balloon: Balloon) -> None:
    _, patches = play(small_balloon, [touch(force=100.0, max_force=100.0)])
    ledger = patches[1].ledger
    assert ledger.by_limit < -1.0
    assert 100.0 + ledger.by_limit == pytest.approx(dot(patches[1].own_force, patches[1].normal))


def test_one_who_shakes_another(small_balloon: Balloon) -> None:
    still = touch(1, force=2.0)
    state, _ = play(small_balloon, [still, touch(2, at=side(BESIDE), force=0.0)])
    blow = touch(2, at=side(BESIDE), force=10.0)
    _, patches = play(small_balloon, [still, blow], 1, state)
    assert patches[2].ledger.by_rate < -1.0
    assert patches[1].ledger.by_rate == 0.0


def played(
    body: Balloon,
    forces: Sequence[float],
    ticks: int,
    state: WorldState | None = None,
    **device: Any,
) -> tuple[WorldState, dict[int, Patch]]:
    """Hands side by side that answer each patch at once, after some ticks."""
    state, patches = state or WorldState(), dict[int, Patch]()
    for _ in range(ticks):
        touches = [
            touch(i, at=side(BESIDE * i), force=force, tick=state.tick, **device)
            for i, force in enumerate(forces, 1)
        ]
        state, patches = play(body, touches, 1, state)
    return state, patches


def test_hands_on_devices_that_damp_little_wait_for_the_room(small_balloon: Balloon) -> None:
    state, patches = played(small_balloon, (2.0, 2.0), 20 * RISE, damping_budget=0.05)
    assert patches[1].room.lag > 0.0
    _, patches = played(small_balloon, (1.0, 1.0), 1, state, damping_budget=0.05)
    assert patches[1].ledger.by_lag > 0.1  # the force is to fall, and does so later
