"""The company in a room: number of watchers, followed views, and pointing. No I/O."""
