"""The command `cohaptic`, and `cohaptic stability`."""
