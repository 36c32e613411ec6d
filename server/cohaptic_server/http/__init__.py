"""What the port answers to plain HTTP, as functions from request to response."""
