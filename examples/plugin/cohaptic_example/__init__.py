"""Bodies, a device, a route and rules of the loop; entry points in `pyproject.toml` name them."""
