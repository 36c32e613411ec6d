"""`cohaptic stability --compliance --delays`: a room of held hands."""

from __future__ import annotations

import math

import pytest

from cohaptic.errors import SettingError
from tests.shared.cli.test_stability import CLOSE, ask

pytestmark = pytest.mark.live

THREE = ["--compliance", CLOSE, "--delays", "[0.1, 0.1, 0.1]"]


def test_a_room_with_its_delays() -> None:
    """Equal delays: the roots are at the theorem's edge (science 3.8)."""
    chosen = ask(*THREE)
    edge = chosen["lag_needed"]
    assert edge == pytest.approx(0.1 * math.sqrt(1.6**2 - 1.0) / math.acos(-1.0 / 1.6))
    assert chosen["lag"] == pytest.approx(edge / 0.7)
    assert chosen["margin"] == pytest.approx(1.0 / 0.7)
    assert chosen["k_h"] == pytest.approx([250.0] * 3)
    assert chosen["coupling"] == pytest.approx(1.6)
    assert chosen["stable"] is True
    for fraction, stable in ((0.99, False), (1.01, True)):
        judged = ask(*THREE, "--lag", fraction * edge, "--sim-period", 0.02)
        assert judged["stable"] is stable
        assert (judged["spectral_radius"] < 1.0) is (judged["growth_rate"] < 0.0) is stable
        assert judged["spectral_radius"] == pytest.approx(math.exp(0.02 * judged["growth_rate"]))
        assert judged["margin"] == pytest.approx(fraction)
    without = ask(*THREE, "--lag", 0)
    assert without["growth_rate"] == pytest.approx(math.log(1.6) / 0.1)
    assert (without["stable"], without["lag"], without["margin"]) == (False, 0.0, 0.0)


def test_a_lone_user_has_no_loop_and_json_has_no_infinity() -> None:
    answer = ask("--compliance", "[[0.004]]", "--delays", "[0.2]")
    assert (answer["spectral_radius"], answer["growth_rate"], answer["margin"]) == (0.0, None, None)
    assert answer["stable"] is True


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--delays", "[0.1, 0.1]"], "loop delay is of shape (2,); it must be of shape (3,)"),
        (["--delays", "[0.1, -0.1, 0.1]"], "loop delay of user 2 is -0.1 s"),
        (["--delays", "[0.1, 0.1, NaN]"], "loop delay of user 3 is nan s"),
        (["--delays", "[0.1, 0.1, 61]"], "from 0 to 60 s"),
        (["--delays", '["soon"]'], "delays is"),
        (["--k-h", "[250, 250]"], "k_h is of shape (2,)"),
        (["--k-h", "[250, 251, 250]"], "k_h of user 2 is 251 N/m; it must be from 0 to 250 N/m"),
        (["--k-h", "[250, 251, 250]"], "outside the theorem"),
        (["--k-h", "[250, -1, 250]"], "k_h of user 2 is -1 N/m"),
        (["--k-h", "[250, NaN, 250]"], "k_h of user 2 is nan N/m"),
        (["--lag", "-0.1"], "lag is -0.1 s; it must be from 0 to 600 s"),
        (["--lag", "nan"], "lag is nan s"),
        (["--lag", "inf"], "lag is inf s"),
        (["--law", "pi"], "law is pi; it must be predictive"),
        (["--sim-period", "0"], "simulation period is 0"),
        (["--delay", "0.1"], "delay is 0.1; it must be left out"),
        (["--integral-gain", "3"], "integral_gain is 3.0; it must be left out"),
        (["--compliance", "[[1, 0.5], [0.1, 1]]", "--delays", "1"], "symmetric"),
        (["--compliance", "[[1, 2], [2, 1]]", "--delays", "1"], "positive definite"),
        (["--compliance", "[[1, NaN], [NaN, 1]]", "--delays", "1"], "not finite"),
        (["--compliance", "[[1, 2, 3], [2, 1, 3]]", "--delays", "1"], "square"),
        (["--compliance", "[[1e-200]]", "--delays", "1"], "own compliance of user 1 is 1e-200"),
    ],
)
def test_a_room_outside_the_theorem_is_refused_in_words(arguments: list[str], words: str) -> None:
    with pytest.raises(SettingError) as caught:
        ask(*THREE, *arguments)
    assert words in str(caught.value)
