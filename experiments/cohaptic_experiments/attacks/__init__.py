"""Attacks on hands that are felt through models: co-users who lie, and servers that lie.

`python -m cohaptic_experiments.attacks --help` searches at random and then climbs: each further
attack is mostly a change of one that was the worst in some measure. All runs are in virtual time,
with the product's room, frames and loops.
"""
