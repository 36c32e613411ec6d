"""The haptic loop at 1 kHz: one period as a function, and the process that runs it."""
