"""Counts of the house: what is crossed, and what would be touched."""

from __future__ import annotations

from types import ModuleType

from count import places
from count.crossing import crossing


def module(name: str, source: str) -> ModuleType:
    """A module of ours that is in no file."""
    made = ModuleType(name)
    exec(compile(source, name, "exec"), made.__dict__)
    return made


def test_a_call_of_a_module_that_was_entered_before_is_a_return() -> None:
    low = module("cohaptic.low", "def work(): pass")
    other = module("elsewhere.helper", "def through(work): work()")
    high = module("cohaptic.high", "def work(then): then()")
    with crossing() as found:
        low.work()
        high.work(low.work)
        high.work(lambda: other.through(low.work))
    assert found.modules == ["cohaptic.low", "cohaptic.high"]
    assert found.returns == [("cohaptic.high", "cohaptic.low")]


def test_what_began_before_is_no_step() -> None:
    high = module("cohaptic.high", "def work(then):\n  with then: low()\ndef low(): pass")
    with crossing() as found:
        pass
    high.work(crossing())
    assert found.modules == []


def test_what_is_known_to_be_there_is_counted() -> None:
    """The catalogue of bodies asks for bodies by their classes, the core has laws and modules."""
    root = places.ROOT
    assert root / "shared/cohaptic/control/law.py" in places.of_a_law()
    assert root / "server/cohaptic_server/objects/object_file.py" in places.of_an_option("simplify")
    modules = places.modules()
    assert modules[root / "shared/cohaptic/vec.py"] == len(
        (root / "shared/cohaptic/vec.py").read_text("utf-8").splitlines()
    )
    assert 0.01 < places.comment_share() < 0.2
