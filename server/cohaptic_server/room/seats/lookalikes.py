"""Whether two names look alike, so that one can be taken for the other.

A name has a skeleton, as in Unicode Technical Standard 39; names with the same one look alike. The
table is a part of the standard's: letters of Cyrillic, Greek and Armenian that are drawn as Latin
ones in common fonts, digits and signs that are drawn as letters, and dashes and apostrophes.
Blanks do not count.
Letters of one case that are drawn as those of the other are told apart, and so are accents.
"""

# ruff: noqa: RUF001 (letters that can be taken for others are the matter here)

from __future__ import annotations

import unicodedata
from functools import lru_cache

# Each letter of the first line looks like the one below it.
_ALIKE = (
    # Cyrillic
    "аеорсухіјѕһԁԛԝѵӏАВЕКМНОРСТХУІЈЅԌԚԜѴӀ",
    "aeopcyxijshdqwvlABEKMHOPCTXYlJSGQWVl",
    # Greek
    "αοσνρυιγχκΑΒΕΖΗΙΚΜΝΟΡΤΥΧϳϲ",
    "aoovpuiyxkABEZHlKMNOPTYXjc",
    # Armenian
    "ոսօհցզՕՍԼ",
    "nuohgqOUL",
    # Latin, and signs. A capital I, a one and a bar are drawn as a small l.
    "ıɑɡǀI1|0",
    "iaglllll",
    "‐‒–—−‘’ʼʹ`",
    "-----'''''",
)
_MAP = {
    ord(theirs): ours
    for looks, like in zip(_ALIKE[::2], _ALIKE[1::2], strict=True)
    for theirs, ours in zip(looks, like, strict=True)
} | {ord("0"): "O"}


@lru_cache(maxsize=4096)  # of names of at most 32 characters: those of the room, and of the removed
def skeleton(name: str) -> str:
    """What a name looks like: the same for all that look alike."""
    plain = unicodedata.normalize("NFD", unicodedata.normalize("NFKC", name))
    drawn = "".join(plain.split()).translate(_MAP).replace("rn", "m")
    return unicodedata.normalize("NFD", drawn)


def looks_like(one: str, other: str) -> bool:
    """Whether one name can be taken for the other, which it may be."""
    return skeleton(one) == skeleton(other)
