"""The local control laws, their gains and their friction, as pure functions."""
