"""Commands of the server: serve, body, demo."""
