"""What keeps a file from being touched, all of it at once, and what can be done about each."""
