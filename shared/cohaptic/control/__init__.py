"""The local control laws, their gains and friction, as pure functions."""
