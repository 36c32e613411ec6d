"""What an object is like before anybody touches it: quality, cost, honesty, a picture."""
