"""The rules of one period of the haptic loop, in the order of `cohaptic_client/loop/chain.py`."""
