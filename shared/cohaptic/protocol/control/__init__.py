"""What control messages are made of."""
