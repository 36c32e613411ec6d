"""A body and a device for cohaptic, known to it by the entry points in `pyproject.toml`."""
