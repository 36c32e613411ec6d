"""Shapes to press on in tests and benchmarks."""
