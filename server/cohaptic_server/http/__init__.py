"""The HTTP service: pure functions that turn a request into a response."""
