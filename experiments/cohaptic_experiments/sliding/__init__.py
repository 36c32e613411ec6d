"""A hand that slides: how far its force is from the truth."""
