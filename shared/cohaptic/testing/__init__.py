"""Doubles that are real code: public, for our tests and for those who build on cohaptic."""

from cohaptic.testing.manual_clock import ManualClock as ManualClock

__all__ = ["ManualClock"]
