"""Fuzzed mesh files, and verdicts on their reading, for `../fuzz_readers.py`."""
