"""A body, a device and a route for cohaptic; entry points in `pyproject.toml` name them."""
