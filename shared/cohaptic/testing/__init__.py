"""Public test doubles, for the tests of cohaptic and of programs that build on it."""

from cohaptic.testing.manual_clock import ManualClock as ManualClock

__all__ = ["ManualClock"]
