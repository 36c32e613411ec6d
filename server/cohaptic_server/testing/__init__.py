"""Test meshes, and one check of the laws of an elastic body, for tests, benchmarks and users."""

from cohaptic_server.testing.check_body import BrokenLawError, check_body

__all__ = ["BrokenLawError", "check_body"]
