"""Two models of a water balloon, linear and nonlinear: rubber round a constant volume."""
