"""A hand in a script: joins a room, and shows its state, samples and events as attributes.

joining.py    `join` for `async with`, and `joined` for `with`, in a thread of its own
live_hand.py  the hand: tip, force, patch, others, why
stream.py     values that a script takes one by one, bounded, and that says what it lost
"""
