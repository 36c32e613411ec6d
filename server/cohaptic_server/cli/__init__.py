"""The server's commands: serve, body, demo."""
