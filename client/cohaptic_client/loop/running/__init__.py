"""The loop at work: its periods over a device, and the life of its process around them."""
