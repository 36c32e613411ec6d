from __future__ import annotations

import pytest

from cohaptic.errors import SettingError
from cohaptic_server.objects.parts.materials import PartMaterials

NAMES = ("liver", "left lobe", "tumour")


@pytest.mark.parametrize(
    ("given", "names", "words"),
    [
        (
            PartMaterials(young=(("tumor", 6e4),)),
            NAMES,
            "--young is given for tumor; it must be for parts of this file, which are: liver, left"
            " lobe, tumour",
        ),
        (
            PartMaterials(nu=(("tumour", 0.2),), every_nu=True),
            NAMES,
            "--poisson is given for tumour; .* no value has liver, left lobe",
        ),
        (PartMaterials(young=(("tumour", 6e4),)), (), "this file has no parts"),
    ],
)
def test_names_that_do_not_fit_are_told_with_those_that_exist(
    given: PartMaterials, names: tuple[str, ...], words: str
) -> None:
    with pytest.raises(SettingError, match=words):
        given.check(names)
