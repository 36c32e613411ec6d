"""A rule as another package writes it, and what it sees of a period: the door for laws and limits.

One class in one file, named by an entry point in the group `cohaptic.rules`, is in the loop of
`cohaptic touch --rule NAME`. Whatever it does, the safety layer is behind it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

if TYPE_CHECKING:
    from cohaptic_client.loop.added import Contact


@runtime_checkable
class AddedRule(Protocol):
    """A rule of another package.

    Attributes:
        name: Its name in recordings and `cohaptic why`: small letters, digits and underscores.
        reason: What it does and why, in a sentence.
        is_law: Whether it computes the normal force, in place of a law of the wire; any other
            rule changes the force after friction, as a filter or a limit does.

    A law may have a further attribute `in_place_of`, the name of that law of the wire: the server
    chooses its gains, and the surface on which it presses is with or without the own dent, as for
    that law. Without it, it is "predictive".
    """

    name: str
    reason: str
    is_law: bool

    def begin(self) -> Any:
        """Return the rule's memory at the beginning, and after a fault; not None."""
        ...

    def apply(self, memory: Any, contact: Contact) -> Any:
        """Do to the contact what the rule does, within a fraction of a millisecond.

        Args:
            memory: What the last period returned.
            contact: The contact in this period; a rule is called while a surface is shown, also
                while the tip is above it, and gives no force there.

        Returns:
            The memory for the next period.
        """
        ...
