"""The water balloon, linear and nonlinear: a rubber membrane round a constant volume."""
