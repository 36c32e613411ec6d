from __future__ import annotations

import pytest

from cohaptic.errors import SettingError
from cohaptic_server.bodies.catalogue import BODIES, build_body


def test_an_unknown_body_is_refused_with_the_known_ones() -> None:
    with pytest.raises(SettingError, match=r"body is 'liver'; it must be one of: balloon"):
        build_body("liver")


@pytest.mark.parametrize("name", sorted(BODIES))
def test_every_body_has_its_own_name(name: str) -> None:
    assert build_body(name).name == name
