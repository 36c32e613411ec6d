from __future__ import annotations

import pytest

from cohaptic.errors import SettingError
from cohaptic_server.objects.option import parse_values
from cohaptic_server.objects.parts.materials import PartMaterials

NAMES = ("liver", "left lobe", "tumour")


@pytest.mark.parametrize(
    ("texts", "words"),
    [
        (["soft"], "--young is 'soft'; it must be a number, or NAME=number"),
        (["=4"], "--young is '=4'; it must be NAME=number"),
        (["1e3", "2e3"], "--young is 1000 and 2000; it must be once without a name"),
    ],
)
def test_values_that_are_none_are_refused(texts: list[str], words: str) -> None:
    with pytest.raises(SettingError, match=words.replace("+", r"\+")):
        parse_values("--young", texts)


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
