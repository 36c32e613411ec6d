"""What happens to the forces of all users in a tick, one stage after another (`chain.py`)."""
