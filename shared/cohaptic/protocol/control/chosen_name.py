"""Tidy the names that people choose, and refuse names with invisible characters.

Compatibility forms (NFKC: full width, ligatures, other blanks) become plain letters. Blanks at the
ends, repeated blanks and variation selectors, which choose a form of the letter before, are
dropped.
"""

from __future__ import annotations

import unicodedata
from typing import Annotated

from pydantic import AfterValidator

from cohaptic.protocol.control.message import MAX_NAME, Name

# Direction marks, joiners, zero-width blanks and private use: such characters are invisible, or
# look different to each reader. Characters that this Python does not know yet may be new letters,
# and pass.
_UNSEEN_KINDS = ("Cc", "Cf", "Co", "Cs", "Zl", "Zp")
# Letters and marks that are drawn as nothing (Default_Ignorable_Code_Point of Unicode, beyond the
# kinds above), the Braille cell without dots, and a filler and a note that are not drawn.
_UNSEEN = frozenset(
    "\u034f\u115f\u1160\u17b4\u17b5\u180b\u180c\u180d\u180f\u2065\u2800\u3164\uffa0"
    "\ufff0\ufff1\ufff2\ufff3\ufff4\ufff5\ufff6\ufff7\ufff8\U00016fe4\U0001d159"
)
_PLANE_OF_TAGS = range(0xE0000, 0xE1000)


def tidy_name(name: str) -> str:
    """The name in the form that a server accepts; raises ValueError if the name is not allowed."""
    plain = "".join(c for c in unicodedata.normalize("NFKC", name) if not _selects_a_form(c))
    for c in plain:
        if unicodedata.category(c) in _UNSEEN_KINDS or c in _UNSEEN or ord(c) in _PLANE_OF_TAGS:
            raise ValueError(f"a name has no character that is not seen, as U+{ord(c):04X} is not")
    tidy = " ".join(plain.split())
    if not 1 <= len(tidy) <= MAX_NAME:
        limit = f"without blanks at its ends a name has 1 to {MAX_NAME} characters"
        raise ValueError(f"{limit}, and this one {len(tidy)}")
    return tidy


def _selects_a_form(c: str) -> bool:
    return "\ufe00" <= c <= "\ufe0f" or "\U000e0100" <= c <= "\U000e01ef"


ChosenName = Annotated[Name, AfterValidator(tidy_name)]
