"""The local control laws, the choice of gains, and the friction model, as pure functions."""
