"""Names that people choose for themselves: made tidy, and refused where not all of them is seen.

Compatibility forms (NFKC: full width, ligatures, other blanks) become the plain letters, blanks at
the ends and in a row go, and so do variation selectors, which choose a form of the letter before.
"""

from __future__ import annotations

import unicodedata
from typing import Annotated

from pydantic import AfterValidator

from cohaptic.protocol.control.message import MAX_NAME, Name

# Turned text, joiners, blanks of no width, private use: nobody sees them, or everybody something
# else. Characters that this Python does not know yet may be new letters, and pass.
_UNSEEN_KINDS = ("Cc", "Cf", "Co", "Cs", "Zl", "Zp")
# Letters and marks that are drawn as nothing (Default_Ignorable_Code_Point of Unicode, beyond those
# kinds), the Braille cell without dots, and a filler and a note that are not drawn.
_UNSEEN = frozenset(
    "\u034f\u115f\u1160\u17b4\u17b5\u180b\u180c\u180d\u180f\u2065\u2800\u3164\uffa0"
    "\ufff0\ufff1\ufff2\ufff3\ufff4\ufff5\ufff6\ufff7\ufff8\U00016fe4\U0001d159"
)
_PLANE_OF_TAGS = range(0xE0000, 0xE1000)


def tidy_name(name: str) -> str:
    """A name as a server takes it; raises ValueError where it cannot."""
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
