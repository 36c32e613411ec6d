from __future__ import annotations

import numpy as np
import pytest

from cohaptic.errors import SettingError
from cohaptic_server.objects.inertia.inertia import WATER, Inertia
from cohaptic_server.objects.parts.parts import Parts

PARTS = Parts(("organ", "tumour"), np.array([0, 0, 1]))


def test_each_tetrahedron_has_the_density_of_its_part() -> None:
    inertia = Inertia(densities=(("tumour", 1100.0),))
    assert inertia.of_elements(PARTS, 3).tolist() == [WATER, WATER, 1100.0]
    assert Inertia(20.0).of_elements(None, 2).tolist() == [20.0, 20.0]
    with pytest.raises(SettingError, match=r"--density is given for bone; .* organ, tumour"):
        Inertia(densities=(("bone", 1900.0),)).of_elements(PARTS, 3)


@pytest.mark.parametrize("density", [0.0, -1.0, 1e5, float("nan"), float("inf")])
def test_a_density_that_nothing_has_is_refused(density: float) -> None:
    with pytest.raises(SettingError, match=r"--density is .* kg/m3; it must be from 1 to 30000"):
        Inertia(density)
    with pytest.raises(SettingError, match=r"--density"):
        Inertia(densities=(("organ", density),))
