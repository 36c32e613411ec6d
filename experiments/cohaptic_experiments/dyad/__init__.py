"""The lag that two hands need, by every criterion that we know."""
