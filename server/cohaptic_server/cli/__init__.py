"""Commands of the server: serve, key, token and invite, and their options."""
