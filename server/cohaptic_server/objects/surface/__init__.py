"""Triangle surfaces from files: read, checked, simplified."""
