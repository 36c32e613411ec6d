"""Hands that clients move models of: what they want, what their hands are, and when it is stable.

wishes: What each hand wants, and the partners of each patch.
learning: The model of each hand, which follows its estimate.
hand_estimate: What a hand may be, from its tip and the force on it.
small_gain: The loop between hands that are modelled, and lags that keep it stable.
"""
