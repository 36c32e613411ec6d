"""An idea on trial: each client moves models of the other hands; the network has intentions."""
