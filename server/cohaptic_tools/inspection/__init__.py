"""Properties of an object before anybody touches it: quality, cost, model limits, a picture."""
