"""Inspects an object before anybody touches it: quality, cost, limits of the model, a picture."""
