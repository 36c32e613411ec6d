"""The HTTP service, as functions from request to response."""
