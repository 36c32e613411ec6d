from __future__ import annotations

import pytest

from cohaptic.errors import SettingError
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.bodies.balloon.rubber_balloon import RubberBalloon
from cohaptic_server.bodies.spring import Spring
from cohaptic_server.objects.catalogue import build_body


@pytest.mark.usefixtures("kernels")
def test_options_choose_the_twin() -> None:
    assert isinstance(build_body("balloon"), Balloon)
    rubber = build_body("balloon", nonlinear=True, damping=1.5)
    assert isinstance(rubber, RubberBalloon)
    assert rubber.damping == 1.5
    viscous = build_body("balloon", damping=0.5)
    assert isinstance(viscous, Balloon)
    assert viscous.damping == 0.5
    spring = build_body("spring", damping=0.5)
    assert isinstance(spring, Spring)
    assert spring.settings.b_o == 0.5 * spring.settings.k_o


@pytest.mark.usefixtures("kernels")
def test_an_option_that_a_body_does_not_have_is_refused_with_those_that_do() -> None:
    words = "body with --nonlinear is 'spring'; it must be one of: balloon"
    with pytest.raises(SettingError, match=words):
        build_body("spring", nonlinear=True)
    with pytest.raises(SettingError, match="damping"):
        build_body("balloon", damping=50.0)
