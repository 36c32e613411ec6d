"""Triangle surfaces from files: reading, checking, simplifying."""
