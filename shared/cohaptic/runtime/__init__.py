"""What the operating system and the event loop are asked for."""
