"""Test objects, and the laws of an elastic body as one check; for tests, benchmarks and users."""
