from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from cohaptic.errors import SettingError
from cohaptic_server.objects.fix_rule import fixed_by_rule

Flags = npt.NDArray[np.bool_]
X = np.stack(np.meshgrid(*[np.linspace(0.0, 0.1, 11)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)


@pytest.mark.parametrize(
    ("rule", "expected"),
    [
        ("z < 5%", X[:, 2] < 0.005),
        ("z <= 0%", X[:, 2] <= 0.0),
        ("Z>95 %", X[:, 2] > 0.095),
        ("x >= 5.5cm and y < 0.015m", (X[:, 0] >= 0.055) & (X[:, 1] < 0.015)),
        ("z < 5mm or z > 95%", (X[:, 2] < 0.005) | (X[:, 2] > 0.095)),
        ("x > 9.5e-2", X[:, 0] > 0.095),
        ("x < 5% or y < 5% and z < 5%", (X[:, 0] < 0.005) | ((X[:, 1:] < 0.005).all(axis=1))),
    ],
)
def test_a_rule_holds_what_it_says(rule: str, expected: Flags) -> None:
    assert np.array_equal(fixed_by_rule(rule, X), expected)


@pytest.mark.parametrize(
    ("rule", "word"),
    [
        ("bottom", "--fix is 'bottom'; it must be like \"z < 10%\""),
        ("z < 10% and", "must be like"),
        ("w < 10%", "must be like"),
        ("z < 10 furlongs", "must be like"),
        ("z < 110%", "shares from 0% to 100%"),
        ("z < -1cm", "float away; it has x from 0 to 0.1 m"),
        ("z >= 0%", "leaves something free"),
    ],
)
def test_a_rule_that_cannot_be_used_says_why(rule: str, word: str) -> None:
    with pytest.raises(SettingError) as error:
        fixed_by_rule(rule, X)
    assert word in str(error.value)
