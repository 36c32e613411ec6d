"""What a loop writes down, what a client says of itself, and how a terminal shows it."""
