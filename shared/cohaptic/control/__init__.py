"""The control law: local models, gains, geometry. Pure functions of numbers."""
