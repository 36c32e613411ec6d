"""Models that follow the hands, on a balloon: what is told, and what a change of models does."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from cohaptic.simulated.hand import Hand
from cohaptic_experiments.partner_models.estimated_replica import (
    EstimatedReplica,
    Estimation,
    News,
    Told,
)
from cohaptic_experiments.transparency.scheme import Arrived, SchemeSession
from cohaptic_experiments.transparency.setting import Setting
from cohaptic_server.bodies.balloon.balloon import Balloon

WEAK = Hand(0.3, 3.0, 200.0)


class Noted(EstimatedReplica):
    """Notes the q and the tips of each tick."""

    def __init__(self, body: Balloon, model: Hand, estimation: Estimation) -> None:
        super().__init__(body, 2, model, estimation)
        self.intended, self.depth = list[list[float]](), list[list[float]]()

    def server(
        self, now: float, inboxes: Mapping[int, Sequence[Arrived[Told]]]
    ) -> Mapping[int, News]:
        news = super().server(now, inboxes)
        if news:
            q = news[0].intended
            self.intended.append(q.tolist())
            self.depth.append((q - [told.give for told in self._told if told]).tolist())
        return news


def test_a_known_hand_tells_where_it_wants_to_be_whatever_pushes_it(
    small_balloon: Balloon,
) -> None:
    setting = Setting(small_balloon, 2, WEAK)
    scheme = Noted(small_balloon, WEAK, Estimation(False, lag=0.0))
    setting.play(scheme, setting.intentions(further=0.008), setting.rests_at + 0.6)
    rested = round((setting.rests_at - 0.2) / scheme.period)
    second = 1
    depth = np.array(scheme.depth)[rested:, second]
    intended = np.array(scheme.intended)[rested:, second]
    assert np.ptp(depth) > 1e-3
    assert np.ptp(intended) < 0.2 * np.ptp(depth)


def test_models_that_change_at_rest_move_no_force(small_balloon: Balloon) -> None:
    setting = Setting(small_balloon, 2)
    scheme = EstimatedReplica(small_balloon, 2, Hand(), Estimation(False, lag=0.0))
    session = SchemeSession(scheme, setting.devices(setting.intentions(), clamped=False))
    session.run(setting.rests_at)
    for client in scheme.clients:
        client.want(np.array([0.3, 3.0, 200.0]), 0.04)
    _, forces = session.run(2.5)
    assert np.abs(scheme.clients[0].model - [0.3, 3.0, 200.0]).max() < 1e-6
    assert forces.min() > 0.3
    assert np.ptp(forces, axis=1).max() < 0.05


def test_weak_hands_that_are_taken_for_others_are_soon_known(small_balloon: Balloon) -> None:
    setting = Setting(small_balloon, 2, WEAK)
    scheme = EstimatedReplica(small_balloon, 2, Hand())
    _, forces = setting.play(scheme, setting.intentions(further=0.004), setting.rests_at + 5.0)
    for client in scheme.clients:
        assert abs(np.log(client.model[1] / WEAK.damping)) < 0.3
    assert np.ptp(forces[:, -500:], axis=1).max() < 0.1
