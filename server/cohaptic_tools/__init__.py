"""The demo of several hands, and the inspection of an object from a file."""
